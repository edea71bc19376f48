#pragma once
// A set of strategy families against all of them.
#include <gtest/gtest.h>

#include <string>

#include "common/job/strategies.h"
#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {

/// 16 batches by `plan`; each set of strategies has a seed of its own.
Batches render_plan(const TestScene& s, const SamplingPlan& plan, int64_t spp, int max_depth);

struct StrategySetTest {
  int max_depth = 1;
  int64_t spp = 1024, weak_spp = 8192;    // of the set; of one of whose samples each tells little
  int64_t all_spp = 256, once_spp = 256;  // of all families; of what connections alone leave out
  float notice = 1.06f;                   // a set that is this much too bright must fail
  float connections_notice = 1.15f;       // connections alone
};
/// Expects that `set` gives the image that all families give, or, of connections alone, what of it has two
/// and more scattering events.
void expect_agrees_with_all(const TestScene& s, Strategies set, const StrategySetTest& test);

/// A test's name for the set that it is of: INSTANTIATE_TEST_SUITE_P(All, Suite, values, set_name).
inline std::string set_name(const ::testing::TestParamInfo<unsigned>& info) {
  std::string name = strategy_names(info.param);
  for (char& c : name) c = c == ',' ? '_' : c == '-' ? '0' : c;
  return name;
}

}  // namespace lightmill::test
