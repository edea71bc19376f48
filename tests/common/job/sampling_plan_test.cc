#include "common/job/sampling_plan.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/job/features.h"
#include "common/job/pilot_report.h"
#include "common/job/strategies.h"

namespace lightmill {
namespace {

TEST(SamplingPlan, ReadsWhatItWrote) {
  for (const SamplingPlan& plan :
       {SamplingPlan{}, SamplingPlan{kLightTracing, 2, 0.25},
        SamplingPlan{kEmissionHits | kNextEvent, 0.5, 4}, SamplingPlan{kAllStrategies, 1, 2, 0.125},
        SamplingPlan{kAllStrategies, 1, 2, 3, true, {"11"}},
        SamplingPlan{kAllStrategies, 1, 2, 1, false, {"11"}}, SamplingPlan{kLightTracing, 2, 1, 1, false},
        SamplingPlan{.strategies = kNextEvent, .rr_depth = 3}}) {
    EXPECT_EQ(plan_from_json(plan_to_json(plan)), plan);
  }
}

// Plans that earlier versions wrote, in files, images and stores.
TEST(SamplingPlan, IsReadByItsOlderNames) {
  EXPECT_EQ(plan_from_json(R"({"aimed":true,"connections":2,"effort":"11","lens_weight":3,"light_paths":1,)"
                           R"("strategies":"hit,next-event,lens,connect"})"),
            (SamplingPlan{kAllStrategies, 1, 2, 3, true, {"11"}}));
  EXPECT_EQ(strategy_names(strategies_named("lens,connect")), "light-tracing,vertex-connection");
  EXPECT_EQ(features_named("textures,lens,connect"),
            features_named("textures,light-tracing,vertex-connection"));
  const auto both =
      R"({"connections":1,"effort":"00","light_paths":1,"sample_allocation":"11","strategies":"hit"})";
  EXPECT_EQ(plan_from_json(both).allocation.levels, "11") << "the name of today counts";
  EXPECT_THROW(plan_from_json(R"({"connections":1,"effort":"x","light_paths":1,"strategies":"hit"})"), Error);
}

TEST(SamplingPlan, RefusesWhatCannotRun) {
  for (const char* json :
       {"", "7", "{}", R"({"connections":1,"light_paths":1})",
        R"({"connections":1,"light_paths":1,"strategies":"","more":1})",
        R"({"connections":1,"light_paths":1,"strategies":""})",
        R"({"connections":1,"light_paths":0.3,"strategies":"hit"})",
        R"({"connections":3,"light_paths":1,"strategies":"hit"})",
        R"({"connections":"1","light_paths":1,"strategies":"hit"})",
        R"({"connections":1,"light_tracing_weight":0.5,"light_paths":1,"strategies":"hit"})",
        R"({"connections":1,"light_tracing_weight":"1","light_paths":1,"strategies":"hit"})",
        R"({"guided_emission":0,"connections":1,"light_paths":1,"strategies":"hit"})",
        R"({"connections":1,"light_paths":1,"rr_depth":1,"strategies":"hit"})",
        R"({"connections":1,"light_paths":1,"rr_depth":4,"strategies":"hit"})",
        R"({"connections":1,"light_paths":1,"rr_depth":"3","strategies":"hit"})",
        R"({"connections":1,"light_paths":1e300,"strategies":"hit"})",
        R"({"connections":1,"light_paths":1,"strategies":"hits"})"}) {
    EXPECT_THROW(plan_from_json(json), Error) << json;
  }
}

TEST(PilotReport, ReadsWhatItWrote) {
  PilotReport report;
  report.chosen = {kAllStrategies, 0.25, 2};
  report.estimates = {{report.chosen, 0.125, 1.5}, {{kEmissionHits, 1, 1}, 3, 0.5}};
  report.samples = 4096;
  report.work.camera_hits = 2.5;
  report.work.lens_rays = 0.75;
  report.features = {{"textures", false, "nothing reads one", "a look-up"}};
  report.emission_guide_gain = 1.25;
  report.missing_light = {"a tenth", "and more"};
  const std::string json = pilot_to_json(report);
  EXPECT_EQ(pilot_to_json(pilot_from_json(json)), json);
  EXPECT_EQ(pilot_from_json(json).features, report.features);
  EXPECT_EQ(pilot_from_json(json).missing_light, report.missing_light);
}

TEST(PilotReport, IsReadByItsOlderNames) {
  PilotReport report;
  report.emission_guide_gain = 1.25;
  report.adaptive_gain = 1.5;
  std::string older = pilot_to_json(report);
  for (const auto& [name, before] : {std::pair<std::string, std::string>{"emission_guide_gain", "aims_gain"},
                                     {"adaptive_gain", "effort_gain"}}) {
    ASSERT_NE(older.find(name), std::string::npos);
    older.replace(older.find(name), name.size(), before);
  }
  EXPECT_EQ(pilot_from_json(older).emission_guide_gain, 1.25);
  EXPECT_EQ(pilot_from_json(older).adaptive_gain, 1.5);
}

TEST(PilotReport, RefusesWhatIsNone) {
  const std::string good = pilot_to_json({});
  EXPECT_NO_THROW(pilot_from_json(good));
  PilotReport wordy;
  wordy.missing_light.assign(8, "a tenth");
  EXPECT_NO_THROW(pilot_from_json(pilot_to_json(wordy)));
  wordy.missing_light.emplace_back("and more");
  EXPECT_THROW(pilot_from_json(pilot_to_json(wordy)), Error);
  wordy.missing_light = {std::string(2001, 'a')};
  EXPECT_THROW(pilot_from_json(pilot_to_json(wordy)), Error);
  for (const std::string& bad :
       {std::string(), std::string("null"), good.substr(0, good.size() - 1),
        std::string(kMaxPilotBytes + 1, ' '),
        std::string(good).replace(good.find("\"samples\":0"), 11, "\"samples\":-1"),
        std::string(good).replace(good.find("\"lens_rays\":0.0"), 15, "\"lens_rays\":-1.0"),
        std::string(good).replace(good.find("\"estimates\":[]"), 14, "\"estimates\":{}")}) {
    EXPECT_THROW(pilot_from_json(bad), Error) << bad.substr(0, 200);
  }
}

}  // namespace
}  // namespace lightmill
