#include "coordinator/coordinator_options.h"

#include <CLI/CLI.hpp>
#include <cstdint>

#include "common/base/size_text.h"
#include "common/build_id/build_id.h"
#include "common/rpc/security_flags.h"

namespace lightmill {
namespace {

constexpr uint64_t kLeastReaderMemory = uint64_t{1} << 26;
constexpr int kMostHooks = 8;

using Options = CoordinatorOptions;

/// Where it listens, and where its data is.
void add_serving_options(CLI::App& app, Options& o) {
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
  app.add_option("--on-done", o.on_done,
                 "Tell this URL (POST, signed) or command (on its standard input) when a job or sequence "
                 "ends; may be given several times")
      ->envname("LIGHTMILL_ON_DONE")
      ->type_name("URL|COMMAND")
      ->allow_extra_args(false)
      ->expected(1, kMostHooks);
  app.add_flag(
      "--check", o.check,
      "Compare every job's image with its ledger and every scene file with its digest, say what does "
      "not agree, and exit");
  app.add_flag("--insecure", o.server.insecure, "Allow plain text on addresses other than loopback")
      ->envname("LIGHTMILL_INSECURE");
  add_security_flags(app, &o.server.security, Side::kServer);
}

void add_tile_options(CLI::App& app, Options& o) {
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
  app.add_option(
         "--scrub-rate", o.scrub_rate,
         "Bytes a second at which scene files are read again to find those that the disk has damaged; 0: "
         "none")
      ->envname("LIGHTMILL_SCRUB_RATE")
      ->capture_default_str();
  app.add_option("--spot-check", o.farm.spot_check,
                 "One in so many tiles is rendered again by another worker and compared; 0: none")
      ->envname("LIGHTMILL_SPOT_CHECK")
      ->check(CLI::Range(0, 1000000).description("0 to 1000000"))
      ->capture_default_str();
}

/// What all workers together may bring, and the memory for it.
void add_load_options(CLI::App& app, Options& o) {
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
}

/// What one client may ask.
void add_quota_options(CLI::App& app, Options& o) {
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
}

void add_log_options(CLI::App& app, Options& o) {
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

}  // namespace

void add_options(CLI::App& app, CoordinatorOptions& options) {
  add_serving_options(app, options);
  add_tile_options(app, options);
  add_load_options(app, options);
  add_quota_options(app, options);
  add_log_options(app, options);
}

void resolve_sizes(CoordinatorOptions& o) {
  o.server.quotas.max_bundle_bytes = static_cast<uint64_t>(o.max_bundle_megabytes * 1e6);
  o.farm.checkpoint_bytes = o.checkpoint_megabytes * 1e6;
  if (o.ingest_limit != "0")
    o.farm.ingest_bytes_per_second = static_cast<double>(parse_size(o.ingest_limit, "--ingest-limit"));
  if (o.scrub_rate != "0")
    o.scrub_bytes_per_second = static_cast<double>(parse_size(o.scrub_rate, "--scrub-rate"));
  o.farm.film_memory_bytes = static_cast<double>(parse_size(o.film_memory, "--film-memory"));
  o.server.quotas.incoming_bytes = parse_size(o.commit_memory, "--commit-memory");
  o.farm.decode_memory_bytes = static_cast<double>(o.server.quotas.incoming_bytes);
  o.reader_memory_bytes = parse_size(o.reader_memory, "--reader-memory", kLeastReaderMemory);
}

}  // namespace lightmill
