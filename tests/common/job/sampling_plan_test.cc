#include "common/job/sampling_plan.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/job/pilot_report.h"

namespace lightmill {
namespace {

TEST(SamplingPlan, ReadsWhatItWrote) {
  for (const SamplingPlan& plan :
       {SamplingPlan{}, SamplingPlan{kLensConnections, 2, 0.25},
        SamplingPlan{kEmissionHits | kNextEvent, 0.5, 4}, SamplingPlan{kAllStrategies, 1, 2, 0.125},
        SamplingPlan{kAllStrategies, 1, 2, 3, true, {"11"}},
        SamplingPlan{kAllStrategies, 1, 2, 1, false, {"11"}},
        SamplingPlan{kLensConnections, 2, 1, 1, false}}) {
    EXPECT_EQ(plan_from_json(plan_to_json(plan)), plan);
  }
}

TEST(SamplingPlan, RefusesWhatCannotRun) {
  for (const char* json : {"", "7", "{}", R"({"connections":1,"light_paths":1})",
                           R"({"connections":1,"light_paths":1,"strategies":"","more":1})",
                           R"({"connections":1,"light_paths":1,"strategies":""})",
                           R"({"connections":1,"light_paths":0.3,"strategies":"hit"})",
                           R"({"connections":3,"light_paths":1,"strategies":"hit"})",
                           R"({"connections":"1","light_paths":1,"strategies":"hit"})",
                           R"({"connections":1,"lens_weight":0.5,"light_paths":1,"strategies":"hit"})",
                           R"({"connections":1,"lens_weight":"1","light_paths":1,"strategies":"hit"})",
                           R"({"guided_emission":0,"connections":1,"light_paths":1,"strategies":"hit"})",
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
