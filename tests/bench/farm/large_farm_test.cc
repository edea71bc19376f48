// The bars that large farms are held to, with an image of ten minutes.
#include <gtest/gtest.h>

#include "tests/bench/farm/simulated_farm.h"

namespace lightmill {
namespace {

void expect_well_used(int workers, double efficiency) {
  const SimulationResult result = simulate({.workers = workers, .seconds = 600});
  EXPECT_GE(result.efficiency(), efficiency);
  EXPECT_LE(result.tail_seconds, 0.02 * result.seconds);
  EXPECT_GT(result.deaths, 0);
}

TEST(LargeFarm, HundredWorkers) { expect_well_used(100, 0.97); }
TEST(LargeFarm, ThousandWorkers) { expect_well_used(1000, 0.90); }

}  // namespace
}  // namespace lightmill
