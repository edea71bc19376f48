#include "tests/bench/simulated_farm.h"

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

TEST(SimulatedFarm, FollowsFromItsSeed) {
  const SimulationOptions options{.workers = 20, .seconds = 30, .spp = 64, .seed = 5};
  const SimulationResult a = simulate(options), b = simulate(options);
  EXPECT_EQ(a.seconds, b.seconds);
  EXPECT_EQ(a.useful_seconds, b.useful_seconds);
  EXPECT_EQ(a.commits, b.commits);
}

}  // namespace
}  // namespace lightmill
