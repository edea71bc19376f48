// A farm of any size on a simulated clock (simulated_farm.h): how well it uses its workers, and how much of a
// coordinator it takes.
//   farm_sim WORKERS SECONDS [SEED] [--rpc-ms MS] [--renew-ms MS] [--lease-seconds S] [--commit-rate N]
//   [--bdpt WxH SPP] [--json]
// --rpc-ms is the processor time of one lease and one commit outside of the farm's core (gRPC, the disk), as
// tests/bench/farm_load measures it (its figure less what is printed here for the core), --renew-ms that of a
// renewal. --bdpt: an image whose tiles bring splats, by workers that are alike and never fail, on the
// machine of the coordinator: `farm_sim 2 7 --bdpt 300x300 128` is what tests/bench/farm_overhead does to
// real ones.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "tests/bench/farm/simulated_farm.h"

namespace lightmill {
namespace {

constexpr double kFullLoad = 0.7;        // of a core, beyond which calls begin to wait for each other
constexpr double kCheckpointPause = 30;  // seconds, of mergers in a tree
constexpr double kLongLease = 60;        // seconds
// Packing a byte of splats, sending, unpacking and merging it, all on one machine.
constexpr double kSplatByteSeconds = 40e-9, kLoopbackBytesPerSecond = 1e9;

void print(const SimulationOptions& options, const SimulationResult& r) {
  const auto commits = static_cast<double>(r.commits);
  std::printf("%d workers, %.1f s (%.1f s if nothing was lost), %d deaths\n", options.workers, r.seconds,
              options.seconds, r.deaths);
  std::printf(
      "efficiency %.2f %% of the workers' time; lost to deaths and races %.2f %%; tail %.2f s = %.2f %%\n",
      100 * r.efficiency(), 100 * r.lost_seconds / r.alive_seconds, r.tail_seconds,
      100 * r.tail_seconds / r.seconds);
  std::printf("tiles %.0f (%.2f s each), cut %llu, raced %llu; %.1f MB committed, %.2f MB/s\n", commits,
              r.useful_seconds / commits, static_cast<unsigned long long>(r.tiles_split),
              static_cast<unsigned long long>(r.races), r.commit_bytes / 1e6,
              r.commit_bytes / 1e6 / r.seconds);
  std::printf(
      "coordinator: %.3f ms a lease, %.3f ms a commit, %.3f ms assumed for their RPCs; %.0f tiles a second\n",
      1e3 * r.lease_core_seconds / static_cast<double>(r.leases), 1e3 * r.commit_core_seconds / commits,
      1e3 * options.rpc_seconds, commits / r.seconds);
  const auto renewals = static_cast<double>(r.renewals);
  if (r.renewals > 0)
    std::printf("  %.3f ms a renewal, %.3f ms assumed for its RPC; %.0f renewals a second\n",
                1e3 * r.renewal_core_seconds / renewals, 1e3 * options.renew_seconds, renewals / r.seconds);
  const double tiles = r.tile_load(options), held = r.renewal_load(options), load = tiles + held;
  const double bears = options.workers / load;
  std::printf("  %.1f %% of one core, %.1f %% of it for renewals\n", 100 * load, 100 * held);
  std::printf("at this tile time one core bears %.0f such workers, %.0f before calls wait (%.0f %% busy)\n",
              bears, bears * kFullLoad, 100 * kFullLoad);
  if (load <= kFullLoad) return;
  if (options.lease_seconds < kLongLease) {
    const double fewer = tiles + held * options.lease_seconds / kLongLease;
    std::printf("with --lease-seconds %.0f in place of %.0f it would be %.1f %%, %.0f workers\n", kLongLease,
                options.lease_seconds, 100 * fewer, kFullLoad * options.workers / fewer);
  }
  const double parts = std::ceil(load / kFullLoad);
  std::printf(
      "%d workers need %.0f coordinators: jobs shared out among them (each knows its own jobs and workers);\n"
      "one job alone: as many jobs of other seeds, their films added; or %.0f mergers of %.0f workers each,\n"
      "which hand in one film of %.0f MB at each checkpoint of %.0f s: %.1f MB/s to the root\n",
      options.workers, parts, parts, std::ceil(options.workers / parts), r.film_bytes / 1e6, kCheckpointPause,
      parts * r.film_bytes / kCheckpointPause / 1e6);
}

void print_json(const SimulationOptions& options, const SimulationResult& r) {
  std::printf(
      "{\"workers\": %d, \"seconds\": %.3f, \"efficiency\": %.5f, \"tail\": %.5f, \"tiles\": %lld, "
      "\"tile_load\": %.4f, \"renewal_load\": %.4f, \"commit_bytes\": %.0f}\n",
      options.workers, r.seconds, r.efficiency(), r.tail_seconds / r.seconds,
      static_cast<long long>(r.commits), r.tile_load(options), r.renewal_load(options), r.commit_bytes);
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  lightmill::SimulationOptions options;
  std::vector<double> numbers;
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--rpc-ms" && i + 1 < argc) {
      options.rpc_seconds = std::atof(argv[++i]) * 1e-3;
    } else if (name == "--renew-ms" && i + 1 < argc) {
      options.renew_seconds = std::atof(argv[++i]) * 1e-3;
    } else if (name == "--lease-seconds" && i + 1 < argc) {
      options.lease_seconds = std::atof(argv[++i]);
    } else if (name == "--commit-rate" && i + 1 < argc) {
      options.commits_per_second = std::atof(argv[++i]);
    } else if (name == "--bdpt" && i + 2 < argc &&
               std::sscanf(argv[i + 1], "%dx%d", &options.width, &options.height) == 2) {
      options.integrator = lightmill::Integrator::kBdpt;
      options.trouble = false;
      options.line_bytes_per_second = lightmill::kLoopbackBytesPerSecond;
      options.seconds_per_byte = lightmill::kSplatByteSeconds;
      options.spp = std::atoll(argv[i + 2]);
      i += 2;
    } else if (name == "--json") {
      json = true;
    } else {
      numbers.push_back(std::atof(argv[i]));
    }
  }
  if (numbers.size() < 2 || numbers.size() > 3 || !(numbers[0] >= 1) || !(numbers[0] <= 1e6) ||
      !(options.lease_seconds > 0) || !(numbers[1] > 0) || options.width < 0 || options.height < 0 ||
      options.spp < 1) {
    std::fprintf(stderr,
                 "usage: farm_sim WORKERS SECONDS [SEED] [--rpc-ms MS] [--renew-ms MS] [--lease-seconds S] "
                 "[--commit-rate N] [--bdpt WxH SPP] [--json]\n");
    return 2;
  }
  options.workers = static_cast<int>(numbers[0]);
  options.seconds = numbers[1];
  if (numbers.size() == 3) options.seed = static_cast<uint64_t>(numbers[2]);
  try {
    const lightmill::SimulationResult result = lightmill::simulate(options);
    (json ? lightmill::print_json : lightmill::print)(options, result);
  } catch (const lightmill::Error& error) {
    std::fprintf(stderr, "farm_sim: %s\n", error.what());
    return 1;
  }
  return 0;
}
