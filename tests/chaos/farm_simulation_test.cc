// Hundreds of seeded lives of a farm in simulated time; what is asked of it is in farm_simulation.cc.
#include "tests/chaos/farm_simulation.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace lightmill {
namespace {

using testing::ChaosCounts;
using testing::FarmSimulation;

TEST(FarmSimulation, NothingIsLostOrCountedTwiceWhateverHappens) {
  const auto from_environment = [](const char* name, uint64_t otherwise) {
    const char* text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : otherwise;
  };
  const uint64_t only =
      from_environment("CHAOS_SEED", 0);  // to see one again, or CHAOS_RUNS of them from there on
  const uint64_t first = only ? only : 1, last = first + from_environment("CHAOS_RUNS", only ? 1 : 150) - 1;
  ChaosCounts all;
  for (uint64_t seed = first; seed <= last; ++seed) {
    const Integrator integrator = seed % 3 == 0   ? Integrator::kAuto
                                  : seed % 3 == 1 ? Integrator::kBdpt
                                                  : Integrator::kLt;
    FarmSimulation simulation(seed, testing::small_job(96, 64, 60, integrator), seed % 4 == 0 ? 3 : 0);
    ChaosCounts counts;
    ASSERT_NO_THROW(counts = simulation.run()) << "CHAOS_SEED=" << seed;
    for (int ChaosCounts::*member :
         {&ChaosCounts::crashes, &ChaosCounts::storage_faults, &ChaosCounts::clock_jumps,
          &ChaosCounts::deaths, &ChaosCounts::pauses, &ChaosCounts::lost, &ChaosCounts::late,
          &ChaosCounts::repeated, &ChaosCounts::damaged, &ChaosCounts::re_leased_after_death,
          &ChaosCounts::races}) {
      all.*member += counts.*member;
    }
    all.checks += counts.checks;
    all.longest_wait_for_dead = std::max(all.longest_wait_for_dead, counts.longest_wait_for_dead);
    all.seconds += counts.seconds;
  }
  std::printf(
      "%d crashes, %d storage faults, %d clock jumps, %d deaths, %d stops; messages: %d lost, %d late, "
      "%d repeated, %d damaged; %d leases again, %d races, longest lease of the dead %.2f s; %.0f s "
      "simulated\n",
      all.crashes, all.storage_faults, all.clock_jumps, all.deaths, all.pauses, all.lost, all.late,
      all.repeated, all.damaged, all.re_leased_after_death, all.races, all.longest_wait_for_dead,
      all.seconds);
  if (only) return;
  EXPECT_GT(all.checks, 500u);
  for (const int count : {all.crashes, all.storage_faults, all.clock_jumps, all.deaths, all.pauses, all.lost,
                          all.late, all.repeated, all.damaged, all.re_leased_after_death, all.races}) {
    EXPECT_GT(count, 50) << "chaos that does not happen tests nothing";
  }
}

}  // namespace
}  // namespace lightmill
