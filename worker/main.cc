// lightmill-worker: leases tiles from a coordinator, renders them on all its threads, commits partials.
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include "common/base/error.h"
#include "common/base/error_line.h"
#include "common/base/log.h"
#include "common/base/size_text.h"
#include "common/base/start_guard.h"
#include "common/build_id/build_id.h"
#include "common/command_line/manual.h"
#include "common/film/partial.h"
#include "common/image/image_library.h"
#include "common/rpc/channel.h"
#include "common/rpc/security_flags.h"
#include "common/sandbox/sandbox.h"
#include "worker/agent/float_mode.h"
#include "worker/agent/grpc_link.h"
#include "worker/agent/host.h"
#include "worker/agent/memory_size.h"
#include "worker/agent/scene_cache.h"
#include "worker/agent/tile_runner.h"
#include "worker/manual.h"
#include "worker/metrics.h"
#include "worker/render/arithmetic_class.h"

namespace lightmill {
namespace {

struct Options {
  std::string coordinator = "localhost:7070";
  int threads = 0;
  std::string pool;
  std::string cache_dir;
  std::string cache_size = "10G";
  std::string scene_memory = "auto", texture_memory = "auto";
  double drain_timeout = 60;
  double idle_timeout = 0;
  bool insecure = false, one_machine = false;
  SecurityFiles security;
  std::string run_as;
  std::string memory_limit = "auto";
  bool no_seccomp = false;
  std::string http;
  std::string log_level = "info", log_format = "text";
};

std::string default_cache_dir() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::string(cache) + "/lightmill";
  if (const char* home = std::getenv("HOME"); home && *home) return std::string(home) + "/.cache/lightmill";
  return "lightmill-cache";
}

/// Test hooks: a worker that claims to be of another build or arithmetic class, and has no work to find out.
std::string overridden(const char* variable, std::string (*value)()) {
  const char* other = std::getenv(variable);
  return other && *other ? std::string(other) : value();
}

/// Stands for the arithmetic class where all workers are on this machine, which takes seconds to find out.
std::string one_machine() { return "machine " + agent::host_name(); }

/// SIGTERM, SIGINT, and SIGUSR1 to end the thread that waits for them.
sigset_t handled_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) sigaddset(&set, signal);
  return set;
}

/// Turns the first SIGTERM or SIGINT into a drain and the second into a stop. The signals must be blocked in
/// all threads.
class SignalThread {
 public:
  explicit SignalThread(agent::TileRunner& runner) {
    thread_ = std::thread([&runner] {
      const sigset_t set = handled_signals();
      int signal = 0;
      for (int count = 0; sigwait(&set, &signal) == 0 && signal != SIGUSR1; ++count) {
        spdlog::info("signal {}: {}", signal,
                     count == 0 ? "draining; once more to stop at once" : "stopping");
        if (count == 0) {
          runner.drain();
        } else {
          runner.stop();
        }
      }
    });
  }
  ~SignalThread() {
    pthread_kill(thread_.native_handle(), SIGUSR1);
    thread_.join();
  }

 private:
  std::thread thread_;
};

void add_options(CLI::App& app, Options& options) {
  app.set_version_flag("--version", build_id());
  app.set_config("--config", "", "Read options from a TOML file");
  app.add_option("--coordinator", options.coordinator,
                 "The coordinator's HOST:PORT; with standbys all of them, with commas between")
      ->envname("LIGHTMILL_COORDINATOR")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "Render threads; 0: all processors")
      ->envname("LIGHTMILL_THREADS")
      ->check(CLI::Range(0, 4096).description("0 to 4096"))
      ->capture_default_str();
  app.add_option("--pool", options.pool, "Take jobs of this pool too")->envname("LIGHTMILL_POOL");
  app.add_option("--cache-dir", options.cache_dir, "Folder for scene files")->envname("LIGHTMILL_CACHE_DIR");
  app.add_option("--cache-size", options.cache_size, "Size of the cache, e.g. 10G")
      ->envname("LIGHTMILL_CACHE_SIZE")
      ->capture_default_str();
  app.add_option("--scene-memory", options.scene_memory,
                 "Memory for scenes that stay warm between tiles, e.g. 2G; auto: half of what there is; "
                 "none: no bound")
      ->envname("LIGHTMILL_SCENE_MEMORY")
      ->capture_default_str();
  app.add_option(
         "--texture-memory", options.texture_memory,
         "Memory for a scene's textures and grids, e.g. 500M; auto: half of what there is; none: no bound")
      ->envname("LIGHTMILL_TEXTURE_MEMORY")
      ->capture_default_str();
  app.add_option("--drain-timeout", options.drain_timeout, "Seconds to finish tiles in after SIGTERM")
      ->envname("LIGHTMILL_DRAIN_TIMEOUT")
      ->check(CLI::Range(0.0, 1e6).description("0 to 1000000"))
      ->capture_default_str();
  app.add_option("--idle-timeout", options.idle_timeout,
                 "Leave after so many seconds without a tile or a coordinator; 0: never")
      ->envname("LIGHTMILL_IDLE_TIMEOUT")
      ->check(CLI::Range(0.0, 1e6).description("0 to 1000000"))
      ->capture_default_str();
  app.add_flag("--one-machine", options.one_machine,
               "All workers of this farm are on this machine: start without the check that all compute the "
               "same bits, which takes seconds");
  app.add_flag("--insecure", options.insecure, "Allow plain text to a coordinator on another machine")
      ->envname("LIGHTMILL_INSECURE");
  add_security_flags(app, &options.security, Side::kClient);
  app.add_option("--run-as", options.run_as, "Become this user first (needs root)")
      ->envname("LIGHTMILL_RUN_AS");
  app.add_option("--memory-limit", options.memory_limit,
                 "Memory beyond which a tile fails, e.g. 8G; auto: nine tenths of what there is; none")
      ->envname("LIGHTMILL_MEMORY_LIMIT")
      ->capture_default_str();
  app.add_flag("--no-seccomp", options.no_seccomp, "Do not filter the process's system calls")
      ->envname("LIGHTMILL_NO_SECCOMP");
  app.add_option("--http", options.http, "Serve /metrics for Prometheus at HOST:PORT; port 0: any free one")
      ->envname("LIGHTMILL_WORKER_HTTP");
  app.add_option("--log-level", options.log_level, "debug, info, warn or error")
      ->envname("LIGHTMILL_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warn", "error"}))
      ->capture_default_str();
  app.add_option("--log-format", options.log_format,
                 "text, or json: an object to a line, with job, tile and worker")
      ->envname("LIGHTMILL_LOG_FORMAT")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
}

SandboxOptions sandbox_options(const Options& options) {
  SandboxOptions sandbox{options.run_as, 0, !options.no_seccomp, !options.http.empty()};
  if (options.memory_limit == "auto") {
    sandbox.memory_bytes = usual_memory_limit();
  } else if (options.memory_limit != "none") {
    sandbox.memory_bytes = parse_size(options.memory_limit, "--memory-limit");
  }
  return sandbox;
}

int run(const Options& options) {
  const uint64_t cache_bytes = parse_size(options.cache_size, "--cache-size");
  const uint64_t scene_bytes = agent::parse_memory(options.scene_memory, "--scene-memory");
  const uint64_t texture_bytes = agent::parse_memory(options.texture_memory, "--texture-memory");
  const int threads = options.threads > 0 ? options.threads : agent::usable_threads();
  const sigset_t blocked = handled_signals();
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);  // before any other thread starts
  signal(SIGPIPE, SIG_IGN);                       // a peer that hangs up is an error of the call
  std::optional<WorkerMetrics> metrics;           // it may listen before the sandbox alone
  if (!options.http.empty()) {
    require_plain_text_allowed(options.http, options.insecure);
    metrics.emplace(options.http);
    spdlog::info("metrics at port {}", metrics->port());
  }
  const SandboxOptions sandbox = sandbox_options(options);
  // Before the sandbox, where its files may be out of reach, and before a coordinator counts on this worker.
  image_library();
  for (const std::string& note : enter_sandbox(sandbox)) spdlog::warn("{}", note);
  agent::set_float_mode();

  agent::RunnerOptions runner_options;
  runner_options.threads = threads;
  runner_options.drain_timeout_seconds = options.drain_timeout;
  runner_options.idle_timeout_seconds = options.idle_timeout;
  runner_options.lease_wait_seconds = 2;
  runner_options.log = [](const std::string& line) { spdlog::info("{}", line); };
  runner_options.debug = [](const std::string& line) { spdlog::debug("{}", line); };
  std::string (*const found_class)() = options.one_machine ? one_machine : arithmetic_class;
  runner_options.registration = {agent::host_name(),
                                 threads,
                                 overridden("LIGHTMILL_TEST_BUILD_ID", build_id),
                                 kPartialSchema,
                                 overridden("LIGHTMILL_TEST_ARITHMETIC_CLASS", found_class),
                                 options.pool,
                                 sandbox.memory_bytes};
  spdlog::info("{}; {} threads; arithmetic class {}", runner_options.registration.build, threads,
               runner_options.registration.arithmetic_class.substr(0, 12));

  agent::GrpcLink grpc(options.coordinator, options.insecure, resolve(options.security, Side::kClient));
  std::optional<MeasuredLink> measured_link;
  if (metrics) measured_link.emplace(grpc, *metrics);
  agent::FarmLink& link = metrics ? static_cast<agent::FarmLink&>(*measured_link) : grpc;
  const std::string folder = options.cache_dir.empty() ? default_cache_dir() : options.cache_dir;
  BuildOptions build(threads, texture_bytes);
  build.spill_folder = folder;
  agent::SceneCache scenes(
      link, {(std::filesystem::path(folder) / "blobs").string(), cache_bytes, scene_bytes, build});
  std::optional<MeasuredSource> measured_scenes;
  if (metrics) {
    measured_scenes.emplace(scenes, *metrics);
    runner_options.accepted = [&](const RenderCounters& counters, double cpu_seconds) {
      metrics->accepted(counters, cpu_seconds);
    };
  }
  agent::RenderSource& source = metrics ? static_cast<agent::RenderSource&>(*measured_scenes) : scenes;
  agent::TileRunner runner(link, source, runner_options);
  const SignalThread signals(runner);
  spdlog::info("leasing from {}", options.coordinator);
  runner.run();
  spdlog::info("done: {} tiles committed", runner.tiles_committed());
  return 0;
}

int main_with_errors(int argc, char** argv) {
  CLI::App app{"Renders tiles for a Lightmill coordinator", "lightmill-worker"};
  Options options;
  add_options(app, options);
  add_manual_flag(app, {"lightmill-worker", "renders tiles for a Lightmill coordinator",
                        "lightmill " + project_version(), kManualDescription, kManualClosing});
  try {
    app.parse(argc, argv);
    start_log("worker", options.log_level, options.log_format);
    return run(options);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "lightmill-worker: %s; see --help\n", error.what());
    return 2;
  } catch (const Error& error) {
    std::fprintf(stderr, "lightmill-worker: %s\n", error.what());
    return error.exit_code();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lightmill-worker: %s\n", error_line(error).c_str());
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
