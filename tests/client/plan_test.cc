// --integrator auto and --plan: what a pilot chose is written down, and repeats the bytes.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "common/pilot_report.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;
using testing::kBox;
using ::testing::Not;
using testing::Outcome;

class Plan : public testing::CliTest {
 protected:
  /// Renders the box at 20 spp; returns its pixels.
  std::vector<float> pixels(std::vector<std::string> options) {
    options.insert(options.begin(), {"render", "box.pbrt", "--spp", "20", "-o", "x.exr"});
    const Outcome outcome = run(options);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    out_ = outcome.out;
    err_ = outcome.err;
    return read_image("x.exr").data;
  }
  std::string out_, err_;
};

TEST_F(Plan, IsChosenByDefaultAndRepeatedFromEveryRecord) {
  write("box.pbrt", kBox);
  const std::vector<float> image = pixels({"--report", "rep", "--json", "--threads", "1"});
  write("job.json", out_);
  EXPECT_THAT(err_, HasSubstr("auto: "));
  const auto job = nlohmann::json::parse(out_);
  EXPECT_EQ(job["settings"]["integrator"], "auto");
  const PilotReport pilot = pilot_from_json(job["pilot"].dump());
  EXPECT_EQ(job["settings"]["plan"], nlohmann::json::parse(plan_to_json(pilot.chosen)));
  EXPECT_EQ(read_image_metadata("x.exr", "plan"), plan_to_json(pilot.chosen));
  EXPECT_EQ(read_image_metadata("x.exr", "integrator"), "auto");
  std::filesystem::rename("x.exr", "first.exr");
  write("bare.json", plan_to_json(pilot.chosen));

  EXPECT_EQ(pixels({"--threads", "3"}), image);
  for (const char* file : {"rep/plan.json", "job.json", "bare.json", "first.exr"}) {
    EXPECT_EQ(pixels({"--plan", file, "--json"}), image) << file;
    EXPECT_TRUE(nlohmann::json::parse(out_)["pilot"].is_null()) << "with a plan no pilot runs";
  }
}

TEST_F(Plan, OfAFixedIntegratorIsWrittenDownToo) {
  write("box.pbrt", kBox);
  const std::vector<float> image = pixels({"--integrator", "pt", "--report", "rep"});
  EXPECT_THAT(err_, Not(HasSubstr("auto")));
  EXPECT_EQ(pixels({"--plan", "rep/plan.json"}), image);
}

TEST_F(Plan, IsOverriddenByASetOfStrategies) {
  write("box.pbrt", kBox);
  const std::vector<float> image = pixels({"--integrator", "pt"});
  EXPECT_EQ(pixels({"--strategies", "hit,next-event"}), image);
}

TEST_F(Plan, AFileWithoutOneIsRefusedInOneLine) {
  write("box.pbrt", kBox);
  write("half.json", "{\"strategies\": \"hit\", \"light_paths\": 1");
  write("list.json", "[1, 2]");
  write("range.json", R"({"strategies": "hit", "light_paths": 3, "connections": 1})");
  write("name.json", R"({"strategies": "hits", "light_paths": 1, "connections": 1})");
  write("deep.json", std::string(200000, '['));
  write("record.json", R"({"settings": {}})");
  write_image(Image(8, 8), "plain.exr");
  for (const char* file :
       {"half.json", "list.json", "range.json", "name.json", "deep.json", "record.json", "plain.exr"}) {
    const Outcome outcome = run({"render", "box.pbrt", "--plan", file});
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(file));
  }
  EXPECT_EQ(run({"render", "box.pbrt", "--plan", "none.json"}).code, 1);
  EXPECT_EQ(run({"render", "box.pbrt", "--plan", "."}).code, 1);
}

}  // namespace
}  // namespace lightmill::client
