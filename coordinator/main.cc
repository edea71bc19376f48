// lightmill-coordinator: wires flags, the data folder, the farm and its servers together.
#include <malloc.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <memory>

#include "common/build_id/build_id.h"
#include "common/base/error_line.h"
#include "common/image/image_library.h"
#include "common/film/partial.h"
#include "common/base/log.h"
#include "common/command_line/manual.h"
#include "common/rpc/security_flags.h"
#include "common/base/size_text.h"
#include "common/base/start_guard.h"
#include "coordinator/access/credential_commands.h"
#include "coordinator/store/data_folder.h"
#include "coordinator/leadership.h"
#include "coordinator/manual.h"
#include "coordinator/store/postgres/postgres_job_store.h"
#include "coordinator/merge/quarantine.h"
#include "coordinator/scene/reader_process.h"
#include "coordinator/server.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "coordinator/merge/store_check.h"

namespace lightmill {
namespace {

struct Options {
  ServerOptions server;
  FarmOptions farm;
  std::string data = "lightmill-data";
  std::string port_file;
  LeadershipOptions leadership;
  bool check = false;
  double checkpoint_megabytes = 256;
  std::string film_memory = "1G";
  std::string commit_memory = "512M", ingest_limit = "100M";
  double max_bundle_megabytes = 65536;
  std::string reader_memory = "4G";
  std::string log_level = "info", log_format = "text";
};

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

void add_options(CLI::App& app, Options& o) {
  app.set_version_flag("--version", build_id());
  app.set_config("--config", "", "Read options from a TOML file");
  app.add_option("--listen", o.server.listen,
                 "HOST:PORT for workers and clients (gRPC); port 0: any free one")
      ->envname("LIGHTMILL_LISTEN")
      ->capture_default_str();
  app.add_option("--http", o.server.http,
                 "HOST:PORT for /healthz, /livez, /metrics and the dashboard; port 0: any")
      ->envname("LIGHTMILL_HTTP")
      ->capture_default_str();
  app.add_option("--data", o.data, "Folder for jobs and scene files")
      ->envname("LIGHTMILL_DATA")
      ->capture_default_str();
  app.add_option(
         "--store", o.leadership.store,
         "Keep jobs in a database, postgresql://USER@HOST/DATABASE, and what is large in --data, which "
         "coordinators share: one leads, the others stand by; default: a file in --data")
      ->envname("LIGHTMILL_STORE")
      ->type_name("URL");
  app.add_option("--advertise", o.leadership.advertise,
                 "HOST:PORT that a standby names as the leader's; default: that of --listen")
      ->envname("LIGHTMILL_ADVERTISE");
  app.add_option("--leader-lease", o.leadership.lease_seconds,
                 "Seconds that a leader may be silent to the database before a standby takes over")
      ->envname("LIGHTMILL_LEADER_LEASE")
      ->check(CLI::Range(1.0, 600.0).description("1 to 600"))
      ->capture_default_str();
  app.add_option("--port-file", o.port_file, "Write the ports to this file once both listen (rpc=N, http=N)")
      ->envname("LIGHTMILL_PORT_FILE");
  app.add_flag("--check", o.check,
               "Compare every job's image with its ledger, say what does not agree, and exit");
  app.add_flag("--insecure", o.server.insecure, "Allow plain text on addresses other than loopback")
      ->envname("LIGHTMILL_INSECURE");
  add_security_flags(app, &o.server.security, Side::kServer);
  app.add_option("--lease-seconds", o.farm.lease_seconds, "How long a lease lasts without renewal")
      ->envname("LIGHTMILL_LEASE_SECONDS")
      ->check(CLI::Range(0.1, 3600.0).description("0.1 to 3600"))
      ->capture_default_str();
  app.add_option("--finish-within", o.server.metrics.finish_within_seconds,
                 "Seconds that the metric lightmill_workers_wanted aims to finish all jobs in")
      ->envname("LIGHTMILL_FINISH_WITHIN")
      ->check(CLI::Range(1.0, 1e6).description("1 to 1000000"))
      ->capture_default_str();
  app.add_option("--tile-seconds", o.farm.target_tile_seconds, "Render time that tiles are sized for")
      ->envname("LIGHTMILL_TILE_SECONDS")
      ->check(CLI::Range(0.01, 3600.0).description("0.01 to 3600"))
      ->capture_default_str();
  app.add_option("--max-attempts", o.farm.max_attempts, "Failures of one tile that fail its job")
      ->envname("LIGHTMILL_MAX_ATTEMPTS")
      ->check(CLI::Range(1, 1000).description("1 to 1000"))
      ->capture_default_str();
  app.add_option("--checkpoint-mb", o.checkpoint_megabytes,
                 "Committed megabytes after which a job is compacted")
      ->envname("LIGHTMILL_CHECKPOINT_MB")
      ->check(CLI::Range(1.0, 1e6).description("1 to 1000000"))
      ->capture_default_str();
  app.add_option("--spot-check", o.farm.spot_check,
                 "One in so many tiles is rendered again by another worker and compared; 0: none")
      ->envname("LIGHTMILL_SPOT_CHECK")
      ->check(CLI::Range(0, 1000000).description("0 to 1000000"))
      ->capture_default_str();
  app.add_option(
         "--ingest-limit", o.ingest_limit,
         "Bytes a second that workers may hand in: tiles get more samples until they fit; 0: no limit")
      ->envname("LIGHTMILL_INGEST_LIMIT")
      ->capture_default_str();
  app.add_option(
         "--commit-rate", o.farm.commits_per_second,
         "Tiles a second that workers may hand in: with more workers than this tiles take longer; 0: no "
         "limit")
      ->envname("LIGHTMILL_COMMIT_RATE")
      ->check(CLI::Range(0.0, 1e6).description("0 to 1000000"))
      ->capture_default_str();
  app.add_option("--max-workers", o.farm.max_workers,
                 "Most workers at once; each takes about 100 kB of memory with its connection")
      ->envname("LIGHTMILL_MAX_WORKERS")
      ->check(CLI::Range(1, 1000000).description("1 to 1000000"))
      ->capture_default_str();
  app.add_option("--film-memory", o.film_memory,
                 "Memory for the images that are being merged; a larger one is merged alone")
      ->envname("LIGHTMILL_FILM_MEMORY")
      ->capture_default_str();
  app.add_option("--commit-memory", o.commit_memory,
                 "Memory for partials that are coming in, and as much for those being unpacked: others wait")
      ->envname("LIGHTMILL_COMMIT_MEMORY")
      ->capture_default_str();
  Quotas& quotas = o.server.quotas;
  app.add_option("--max-pixels", quotas.max_pixels, "Largest image of a job, in pixels")
      ->envname("LIGHTMILL_MAX_PIXELS")
      ->check(CLI::Range(int64_t{1}, kMaxPixels).description("1 to 268435456"))
      ->capture_default_str();
  app.add_option("--max-bundle-mb", o.max_bundle_megabytes, "Most megabytes of a scene's files together")
      ->envname("LIGHTMILL_MAX_BUNDLE_MB")
      ->check(CLI::Range(0.001, 1e9).description("0.001 to 1e9"))
      ->capture_default_str();
  app.add_option("--reader-memory", o.reader_memory, "Memory for reading a scene that a browser submits")
      ->envname("LIGHTMILL_READER_MEMORY")
      ->capture_default_str();
  app.add_option("--max-open-jobs", o.farm.max_open_jobs, "Most jobs that have not ended")
      ->envname("LIGHTMILL_MAX_OPEN_JOBS")
      ->check(CLI::Range(1, 100000).description("1 to 100000"))
      ->capture_default_str();
  app.add_option("--submit-rate", quotas.submissions_per_minute, "Jobs a minute that one token may submit")
      ->envname("LIGHTMILL_SUBMIT_RATE")
      ->check(CLI::Range(0.01, 1e6).description("0.01 to 1000000"))
      ->capture_default_str();
  app.add_option("--max-connections", quotas.max_connections, "Most connections to the gRPC port")
      ->envname("LIGHTMILL_MAX_CONNECTIONS")
      ->check(CLI::Range(1, 1000000).description("1 to 1000000"))
      ->capture_default_str();
  app.add_option("--connection-rate", quotas.connections_per_second,
                 "New connections a second that one address may open, after five times as many at once")
      ->envname("LIGHTMILL_CONNECTION_RATE")
      ->check(CLI::Range(0.2, 1e6).description("0.2 to 1000000"))
      ->capture_default_str();
  app.add_option("--stall-seconds", quotas.stall_seconds,
                 "Seconds that a call may wait for a peer that neither takes nor sends anything")
      ->envname("LIGHTMILL_STALL_SECONDS")
      ->check(CLI::Range(0.1, 86400.0).description("0.1 to 86400"))
      ->capture_default_str();
  app.add_option("--log-level", o.log_level, "debug, info, warn or error")
      ->envname("LIGHTMILL_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warn", "error"}))
      ->capture_default_str();
  app.add_option("--log-format", o.log_format,
                 "text, or json: an object to a line, with job, tile and worker")
      ->envname("LIGHTMILL_LOG_FORMAT")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
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
int report_problems(JobStore& store) {
  const std::vector<std::string> problems = check_store(store);
  for (const std::string& problem : problems)
    std::fprintf(stderr, "lightmill-coordinator: %s\n", problem.c_str());
  if (problems.empty()) std::printf("%zu jobs agree with their ledgers\n", store.jobs().size());
  return problems.empty() ? 0 : 1;
}

int check_data(const Options& options) {
  const bool shared = !options.leadership.store.empty();
  const DataFolder data(options.data, shared);
  if (!shared) {
    SqliteJobStore store(data.store_path());
    return report_problems(store);
  }
  PostgresLease lease(PostgresUrl(options.leadership.store), options.leadership.lease_seconds);
  if (!lease.try_take()) {
    throw Error(ErrorKind::kFailed, "the coordinator at " + lease.holder() +
                                        " is at work on this database; stop it before --check");
  }
  PostgresJobStore store(lease, options.data);
  return report_problems(store);
}

int run(Options options) {
  if (options.check) return check_data(options);
  keep_freed_memory();
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any other thread starts
  signal(SIGPIPE, SIG_IGN);

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
  Quarantine quarantine(data.quarantine_folder());
  const SteadyClock clock;
  options.farm.build = build_id();
  options.farm.schema = kPartialSchema;
  options.server.quotas.max_bundle_bytes = static_cast<uint64_t>(options.max_bundle_megabytes * 1e6);
  options.farm.checkpoint_bytes = options.checkpoint_megabytes * 1e6;
  if (options.ingest_limit != "0") {
    options.farm.ingest_bytes_per_second =
        static_cast<double>(parse_size(options.ingest_limit, "--ingest-limit"));
  }
  options.farm.film_memory_bytes = static_cast<double>(parse_size(options.film_memory, "--film-memory"));
  options.server.quotas.incoming_bytes = parse_size(options.commit_memory, "--commit-memory");
  options.farm.decode_memory_bytes = static_cast<double>(options.server.quotas.incoming_bytes);
  const std::string reader_memory =
      std::to_string(parse_size(options.reader_memory, "--reader-memory", uint64_t{1} << 26));
  TileLog tile_log;
  options.server.tile_log = &tile_log;
  options.farm.log = [&tile_log, log](const std::string& line) {
    log(line);
    tile_log.add(line);
  };
  options.farm.quarantine = [&](const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                                const std::string& bytes) { quarantine.keep(lease, worker, reason, bytes); };
  options.server.lease_seconds = options.farm.lease_seconds;

  const auto serve = [&](Leadership::Turn turn) {
    BlobStore blobs(data.blob_folder());
    Farm farm(std::move(turn.store), clock, options.farm);
    ReaderProcess reader({"/proc/self/exe", kReadScene, "--memory", reader_memory}, {});
    turn.server.read_scene = [&reader](const SceneQuestion& question) { return reader.read(question); };
    const Server server(turn.server, farm, blobs);
    spdlog::info("{}; data in {}", build_id(), options.data);
    spdlog::info("listening: rpc port {}, http port {}, {}", server.rpc_port(), server.http_port(),
                 options.server.security.tls() ? "TLS and tokens" : "plain text for everybody");
    turn.ready({server.rpc_port(), server.http_port()});
    serve_until_signal(farm, signals, turn.ended);
    reader.stop();
  };
  const auto listening = [&](const Ports& ports) {
    if (options.port_file.empty()) return;
    write_file_atomically(options.port_file,
                          "rpc=" + std::to_string(ports.rpc) + "\nhttp=" + std::to_string(ports.http) + "\n");
  };
  if (options.leadership.store.empty()) {
    serve({std::make_unique<SqliteJobStore>(data.store_path()), options.server, listening,
           [] { return false; }});
  } else {
    Leadership(options.leadership, signals, listening).run(options.server, options.data, serve);
  }
  return 0;
}

int main_with_errors(int argc, char** argv) {
  CLI::App app{"Keeps jobs, leases tiles to workers and merges what they render", "lightmill-coordinator"};
  Options options;
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
