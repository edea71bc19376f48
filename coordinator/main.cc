// lightmill-coordinator: wires flags, the data folder, the farm and its servers together.
#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/error_line.h"
#include "common/base/log.h"
#include "common/base/start_guard.h"
#include "common/build_id/build_id.h"
#include "common/command_line/manual.h"
#include "common/film/partial.h"
#include "common/image/image_library.h"
#include "common/rpc/security_flags.h"
#include "coordinator/access/credential_commands.h"
#include "coordinator/coordinator_options.h"
#include "coordinator/hooks/end_message.h"
#include "coordinator/hooks/hook_runner.h"
#include "coordinator/leadership.h"
#include "coordinator/manual.h"
#include "coordinator/merge/quarantine.h"
#include "coordinator/merge/store_check.h"
#include "coordinator/scene/reader_process.h"
#include "coordinator/server.h"
#include "coordinator/service/background.h"
#include "coordinator/store/blob_check.h"
#include "coordinator/store/blob_scrub.h"
#include "coordinator/store/data_folder.h"
#include "coordinator/store/postgres/postgres_job_store.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"

namespace lightmill {
namespace {

constexpr long kTickNanoseconds = 250'000'000;
constexpr int kArenas = 4;
constexpr int kTrimBytes = 32 << 20, kMappedBytes = 4 << 20;

/// The allocator keeps what partials come and go in: given back to the system after each, it cost a twelfth
/// of the processor time in page faults. Few arenas, so that what is kept is bounded by their number and not
/// the threads'.
void keep_freed_memory() {
  mallopt(M_ARENA_MAX, kArenas);
  mallopt(M_TRIM_THRESHOLD, kTrimBytes);
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
}

/// The coordinator runs itself with this word to read scenes of strangers.
constexpr const char* kReadScene = "read-scene";

void add_read_scene(CLI::App& app, std::function<int()>* command) {
  auto limits = std::make_shared<ReaderLimits>();
  CLI::App* verb = app.add_subcommand(kReadScene)->group("");
  verb->add_option("--memory", limits->memory_bytes);
  verb->callback([command, limits] { *command = [limits] { return read_scene_and_answer(*limits); }; });
}

/// Ticks the farm until SIGTERM or SIGINT, which must be blocked in all threads, or until `ended`.
void serve_until_signal(Farm& farm, const sigset_t& signals, const std::function<bool()>& ended) {
  const timespec pause{0, kTickNanoseconds};
  while (!ended()) {
    const int signal = sigtimedwait(&signals, nullptr, &pause);
    if (signal > 0) {
      spdlog::info("signal {}: shutting down", signal);
      return;
    }
    try {
      farm.tick();
    } catch (const std::exception& e) {
      spdlog::error("{}", e.what());
    }
  }
}

/// What the store holds, looked at while no coordinator runs on it. The exit code.
int report_problems(JobStore& store, const DataFolder& data) {
  BlobStore blobs(data.blob_folder());
  std::vector<std::string> problems = check_store(store);
  for (std::string& problem : check_blobs(store, blobs)) problems.push_back(std::move(problem));
  for (const std::string& problem : problems)
    std::fprintf(stderr, "lightmill-coordinator: %s\n", problem.c_str());
  if (problems.empty()) {
    std::printf("%zu jobs agree with their ledgers; %zu scene files are right\n", store.jobs().size(),
                blobs.digests().size());
  }
  return problems.empty() ? 0 : 1;
}

int check_data(const CoordinatorOptions& options) {
  const bool shared = !options.leadership.store.empty();
  const DataFolder data(options.data, shared);
  if (!shared) {
    SqliteJobStore store(data.store_path());
    return report_problems(store, data);
  }
  PostgresLease lease(PostgresUrl(options.leadership.store), options.leadership.lease_seconds);
  if (!lease.try_take()) {
    throw Error(ErrorKind::kFailed, "the coordinator at " + lease.holder() +
                                        " is at work on this database; stop it before --check");
  }
  PostgresJobStore store(lease, options.data);
  return report_problems(store, data);
}

/// SIGTERM and SIGINT, blocked from now on: for the only thread that there is yet, and all that it starts.
sigset_t block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return signals;
}

void write_ports(const std::string& file, const Ports& ports) {
  if (file.empty()) return;
  write_file_atomically(file,
                        "rpc=" + std::to_string(ports.rpc) + "\nhttp=" + std::to_string(ports.http) + "\n");
}

std::vector<std::unique_ptr<Hook>> hooks_of(const CoordinatorOptions& options, const DataFolder& data) {
  std::vector<std::unique_ptr<Hook>> hooks;
  if (options.on_done.empty()) return hooks;
  const WebhookSecret secret = webhook_secret_of(data.hook_secret_path());
  for (const std::string& what : options.on_done) hooks.push_back(make_hook(what, secret));
  return hooks;
}

HookNews news_of(Farm& farm) {
  return {[&farm](size_t most) { return farm.untold_ends(most); },
          [&farm](const EndNote& note) { return end_message(farm, note, std::time(nullptr)); },
          [&farm](const EndNote& note) { farm.told(note); }};
}

/// Is the farm, on the turn's store, until a signal comes or the turn ends.
void serve(const CoordinatorOptions& options, const DataFolder& data, const Clock& clock,
           const sigset_t& signals, Leadership::Turn turn) {
  BlobStore blobs(data.blob_folder(), options.server.log);
  std::vector<std::unique_ptr<Hook>> hooks = hooks_of(options, data);
  Farm farm(std::move(turn.store), clock, options.farm);
  ReaderProcess reader(
      {"/proc/self/exe", kReadScene, "--memory", std::to_string(options.reader_memory_bytes)}, {});
  turn.server.read_scene = [&reader](const SceneQuestion& question) { return reader.read(question); };
  WantedBlobs wanted(farm, blobs, clock);
  turn.server.wanted = &wanted;
  turn.server.thumbnail_folder = data.thumbnail_folder();
  const Server server(turn.server, farm, blobs);
  spdlog::info("{}; data in {}", build_id(), options.data);
  spdlog::info("listening: rpc port {}, http port {}, {}", server.rpc_port(), server.http_port(),
               options.server.security.tls() ? "TLS and tokens" : "plain text for everybody");
  turn.ready({server.rpc_port(), server.http_port()});
  BlobScrub scrub(blobs, options.scrub_bytes_per_second, options.server.log);
  Background background(clock, options.server.log);
  Background::Task step;
  if (options.scrub_bytes_per_second > 0) step = [&scrub](double now) { return scrub.step(now); };
  const auto look_around = [&wanted](double) {
    wanted.look_around();
    return WantedBlobs::kLookSeconds;
  };
  background.start({look_around, step});
  const HookRunner runner(std::move(hooks), news_of(farm), clock, options.server.log);
  serve_until_signal(farm, signals, turn.ended);
  reader.stop();
}

int run(CoordinatorOptions options) {
  if (options.check) return check_data(options);
  keep_freed_memory();
  const sigset_t signals = block_signals();

  options.server.security = resolve(options.server.security, Side::kServer);
  EventLog events;
  options.server.events = &events;
  const auto log = [&events](const std::string& line) {
    spdlog::warn("{}", line);
    events.add(line);
  };
  options.server.log = log;
  // Now, and not when somebody asks for a picture: where its libraries are in the way of a limit, or belong
  // to another build, nothing depends on this coordinator yet.
  image_library();
  const DataFolder data(options.data, !options.leadership.store.empty());
  hooks_of(options, data);  // says now what is wrong with them, and not once this coordinator leads
  Quarantine quarantine(data.quarantine_folder());
  const SteadyClock clock;
  options.farm.build = build_id();
  options.farm.tells_ends = !options.on_done.empty();
  options.farm.schema = kPartialSchema;
  resolve_sizes(options);
  TileLog tile_log;
  options.server.tile_log = &tile_log;
  options.farm.log = [&tile_log, log](const std::string& line) {
    log(line);
    tile_log.add(line);
  };
  options.farm.quarantine = [&](const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                                const std::string& bytes) { quarantine.keep(lease, worker, reason, bytes); };
  options.server.lease_seconds = options.farm.lease_seconds;

  const auto lead = [&](Leadership::Turn turn) { serve(options, data, clock, signals, std::move(turn)); };
  const auto listening = [&](const Ports& ports) { write_ports(options.port_file, ports); };
  if (options.leadership.store.empty()) {
    lead({std::make_unique<SqliteJobStore>(data.store_path()), options.server, listening,
          [] { return false; }});
  } else {
    Leadership(options.leadership, signals, listening).run(options.server, options.data, lead);
  }
  return 0;
}

int main_with_errors(int argc, char** argv) {
  CLI::App app{"Keeps jobs, leases tiles to workers and merges what they render", "lightmill-coordinator"};
  CoordinatorOptions options;
  std::function<void()> command;
  add_options(app, options);
  std::function<int()> read_scene;
  add_credential_commands(app, &command);
  add_read_scene(app, &read_scene);
  add_manual_flag(app,
                  {"lightmill-coordinator", "keeps jobs, leases tiles to workers and merges what they render",
                   "lightmill " + project_version(), kManualDescription, kManualClosing});
  try {
    app.parse(argc, argv);
    if (command) {
      command();
      return 0;
    }
    if (read_scene) return read_scene();
    start_log("coordinator", options.log_level, options.log_format);
    return run(options);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "lightmill-coordinator: %s; see --help\n", error.what());
    return 2;
  } catch (const Error& error) {
    std::fprintf(stderr, "lightmill-coordinator: %s\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lightmill-coordinator: %s\n", error_line(error).c_str());
    return 1;
  }
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  lightmill::started();
  try {
    return lightmill::main_with_errors(argc, argv);
  } catch (...) {  // printing help, or an error, failed
    return 1;
  }
}
