#include "common/farm/pilot_result.h"

#include <gtest/gtest.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

PilotReport report() {
  const SamplingPlan chosen{kEmissionHits | kNextEvent | kLightTracing, 0.5, 1};
  return {chosen, {{chosen, 0.5, 2}, {SamplingPlan(), 0.25, 20}}, 1000, {}};
}

TEST(PilotResult, RoundTrip) {
  const PilotResult back = decode_pilot(encode_pilot({report(), 1.25}));
  EXPECT_EQ(back.cpu_seconds, 1.25);
  EXPECT_EQ(pilot_to_json(back.report), pilot_to_json(report()));
}

TEST(PilotResult, NothingElseIsTaken) {
  const std::string good = encode_pilot({report(), 1});
  for (size_t length = 0; length < good.size(); ++length)
    EXPECT_THROW(decode_pilot(good.substr(0, length)), Error) << length;
  for (const std::string bad : {"[]", "7", "null", "{}", "{\"report\":{}}", "{\"cpu_seconds\":1}"})
    EXPECT_THROW(decode_pilot(bad), Error) << bad;
  EXPECT_THROW(decode_pilot(good + std::string(kMaxPilotResultBytes, ' ')), Error);
}

TEST(PilotResult, DeepNestingDoesNotOverflowTheStack) {
  const std::string open(500000, '['), close(500000, ']');
  EXPECT_THROW(decode_pilot("{\"cpu_seconds\":1,\"report\":" + open + close + "}"), Error);
  EXPECT_THROW(decode_pilot("{\"cpu_seconds\":1,\"report\":{\"chosen\":" + open + close + "}}"), Error);
}

TEST(PilotResult, OnlyTheEmptyTileIsThePilot) {
  EXPECT_TRUE(is_pilot({}));
  EXPECT_FALSE(is_pilot({{0, 0, 1, 1}, 0, 1}));
}

}  // namespace
}  // namespace lightmill
