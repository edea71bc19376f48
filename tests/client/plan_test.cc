// --integrator auto and --plan: what a pilot chose is written down, and repeats the bytes.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "common/job/pilot_report.h"
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

TEST_F(Plan, IsGivenByOlderOptions) {
  write("box.pbrt", kBox);
  EXPECT_EQ(pixels({"--integrator", "bdpt", "--lens-weight", "3", "--effort", "uniform"}),
            pixels({"--integrator", "bdpt", "--light-tracing-weight", "3", "--uniform-sampling"}));
  EXPECT_EQ(pixels({"--strategies", "hit,lens"}), pixels({"--strategies", "hit,light-tracing"}));
  const Outcome wrong = run({"render", "box.pbrt", "--effort", "much"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("expected adaptive or uniform"));
  EXPECT_THAT(run({"render", "--help"}).out, Not(HasSubstr("--effort")));
  // What is printed for scripts has both names.
  const Outcome explained = run({"explain", "box.pbrt", "--no-pilot", "--json"});
  EXPECT_THAT(explained.out, HasSubstr("\"missing_light_shares\""));
  EXPECT_THAT(explained.out, HasSubstr("\"unmet_light\""));
}

TEST_F(Plan, HasALightTracingWeightThatShowsInTheImageAndIsOneOfFew) {
  write("box.pbrt", kBox);
  const std::vector<float> one = pixels({"--integrator", "bdpt"});
  EXPECT_EQ(pixels({"--integrator", "bdpt", "--light-tracing-weight", "1"}), one);
  EXPECT_NE(pixels({"--integrator", "bdpt", "--light-tracing-weight", "3"}), one);
  // Without light tracing there is nothing to weigh.
  const std::vector<float> without =
      pixels({"--integrator", "bdpt", "--strategies", "hit,next-event,vertex-connection"});
  EXPECT_EQ(pixels({"--integrator", "bdpt", "--strategies", "hit,next-event,vertex-connection",
                    "--light-tracing-weight", "3"}),
            without);
  const Outcome outcome = run({"render", "box.pbrt", "--light-tracing-weight", "2"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("light_tracing_weight must be one of 0.125, 1.0, 3.0"));
}

// A point light over glass, seen with hair, or through a realistic camera: what light paths can't reach is
// left out of every integrator's plan alike in renderer and farm, and said to be missing.
TEST_F(Plan, IsOfWhatHairAndARealisticCameraAllow) {
  constexpr char kFilm[] =
      "LookAt 0 1 4 0 0.5 0 0 1 0\nFilm \"rgb\" \"integer xresolution\" 16 "
      "\"integer yresolution\" 16\n";
  constexpr char kWorld[] = R"(WorldBegin
LightSource "point" "point3 from" [0 3 1] "rgb I" [10 10 10]
Shape "trianglemesh" "point3 P" [-5 0 -5 5 0 -5 5 0 5 -5 0 5] "integer indices" [0 1 2 0 2 3]
Material "dielectric"
Shape "sphere" "float radius" 0.5
)";
  constexpr char kHair[] =
      "Material \"hair\"\nShape \"curve\" \"string type\" \"flat\" "
      "\"point3 P\" [-1 0 0 -1 .5 0 -1 1 0 -1 1.5 0.5] \"float width\" 0.05\n";
  write("lens.dat", "50 5 1.5 20\n-50 48 1 20\n");
  write("hair.pbrt", std::string(kFilm) + "Camera \"perspective\"\n" + kWorld + kHair);
  write("lens.pbrt", std::string(kFilm) +
                         "Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"float focusdistance\" 4\n" +
                         kWorld);
  for (const char* scene : {"hair.pbrt", "lens.pbrt"}) {
    for (const char* integrator : {"auto", "bdpt", "pt"}) {
      const Outcome outcome =
          run({"render", scene, "--integrator", integrator, "--spp", "16", "-o", "x.exr"});
      EXPECT_EQ(outcome.code, 0) << scene << ' ' << integrator << ": " << outcome.err;
      EXPECT_THAT(outcome.err, HasSubstr("leaves out light of paths LS")) << scene << ' ' << integrator;
    }
    for (const std::vector<std::string>& asked :
         std::vector<std::vector<std::string>>{{"--integrator", "lt"},
                                               {"--strategies", "hit,light-tracing"},
                                               {"--plan-override", "light-tracing"}}) {
      std::vector<std::string> line = {"render", scene, "--spp", "16", "-o", "x.exr"};
      line.insert(line.end(), asked.begin(), asked.end());
      const Outcome outcome = run(line);
      EXPECT_EQ(outcome.code, 2) << scene << ' ' << asked[1] << ": " << outcome.err;
      EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
    }
  }
}

TEST_F(Plan, AFileWithoutOneIsRefusedInOneLine) {
  write("box.pbrt", kBox);
  write("half.json", "{\"strategies\": \"hit\", \"light_paths\": 1");
  write("list.json", "[1, 2]");
  write("range.json", R"({"strategies": "hit", "light_paths": 3, "connections": 1})");
  write("weight.json",
        R"({"strategies": "light-tracing", "light_paths": 1, "connections": 1, "light_tracing_weight": 2})");
  write("name.json", R"({"strategies": "hits", "light_paths": 1, "connections": 1})");
  write("deep.json", std::string(200000, '['));
  write("record.json", R"({"settings": {}})");
  write_image(Image(8, 8), "plain.exr");
  for (const char* file : {"half.json", "list.json", "range.json", "weight.json", "name.json", "deep.json",
                           "record.json", "plain.exr"}) {
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
