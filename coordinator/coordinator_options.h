#pragma once
// The options of lightmill-coordinator: command line, environment and configuration file.
#include <cstdint>
#include <string>
#include <vector>

#include "coordinator/core/farm_options.h"
#include "coordinator/leadership.h"
#include "coordinator/server.h"

namespace CLI {
class App;
}

namespace lightmill {

struct CoordinatorOptions {
  ServerOptions server;
  FarmOptions farm;
  std::string data = "lightmill-data";
  std::string port_file;
  std::vector<std::string> on_done;  // whom to tell when a job ends: URLs and commands
  LeadershipOptions leadership;
  bool check = false;
  std::string scrub_rate = "4M";
  double scrub_bytes_per_second = 0;  // that resolve_sizes() fills in
  double checkpoint_megabytes = 256;
  std::string film_memory = "1G";
  std::string commit_memory = "512M", ingest_limit = "100M";
  double max_bundle_megabytes = 65536;
  std::string reader_memory = "4G";
  uint64_t reader_memory_bytes = 0;  // that resolve_sizes() fills in
  std::string log_level = "info", log_format = "text";
};

/// Adds them to the program's; `options` must outlive it.
void add_options(CLI::App& app, CoordinatorOptions& options);
/// Fills in what was given as a size, as "512M", in `server` and `farm`. Throws Error(kUsage).
void resolve_sizes(CoordinatorOptions& options);

}  // namespace lightmill
