#include "tests/bench/farm/simulated_farm.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(SimulatedFarm, UsesItsWorkers) {
  const SimulationOptions options{.workers = 100, .seconds = 60, .spp = 512};
  const SimulationResult result = simulate(options);
  EXPECT_GE(result.efficiency(), 0.95);
  EXPECT_LE(result.tail_seconds, 0.03 * result.seconds);
  // All that was rendered counts, was lost, or was still under way.
  EXPECT_LE(result.useful_seconds + result.lost_seconds, result.alive_seconds);
  EXPECT_GT(result.deaths, 0);
  EXPECT_GT(result.tile_load(options), 0);
}

/// Tiles with splats are few and long, so that the end is what workers lose: beside it a hand-in costs each
/// of them 40 ns of processor a byte, and a lease 5 ms.
TEST(SimulatedFarm, FewWorkersEndAJobOfLargeTilesTogether) {
  for (const int workers : {2, 8}) {
    double efficiency = 0;
    constexpr int kSeeds = 5;
    for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const SimulationResult result = simulate({.workers = workers,
                                                .seconds = 7,
                                                .spp = 64 * workers,
                                                .seed = seed,
                                                .width = 300,
                                                .height = 300,
                                                .integrator = Integrator::kBdpt,
                                                .trouble = false,
                                                .line_bytes_per_second = 1e9,
                                                .seconds_per_byte = 40e-9});
      const double handing_in = 40e-9 * result.commit_bytes;
      efficiency += (result.useful_seconds + handing_in) / result.alive_seconds / kSeeds;
    }
    EXPECT_GE(efficiency, 0.98) << workers;
  }
}

TEST(SimulatedFarm, FollowsFromItsSeed) {
  const SimulationOptions options{.workers = 20, .seconds = 30, .spp = 64, .seed = 5};
  const SimulationResult a = simulate(options), b = simulate(options);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.useful_seconds, b.useful_seconds);
  EXPECT_EQ(a.commits, b.commits);
}

}  // namespace
}  // namespace lightmill
