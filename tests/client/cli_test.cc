#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "common/image/image.h"
#include "common/job/pilot_report.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kBox;
using ::testing::MatchesRegex;
using ::testing::Not;
using testing::Outcome;

class Cli : public testing::CliTest {};

constexpr const char* kVerbs[] = {"render", "submit",  "watch",   "jobs",   "job",        "workers", "tiles",
                                  "logs",   "pause",   "resume",  "cancel", "retry",      "extend",  "fetch",
                                  "check",  "explain", "compare", "report", "completion", "man"};

TEST_F(Cli, EveryVerbHasHelpAndVersion) {
  for (const char* verb : kVerbs) {
    const Outcome help = run({verb, "--help"});
    EXPECT_EQ(help.code, 0) << verb;
    EXPECT_THAT(help.out, HasSubstr("Usage")) << verb;
    EXPECT_THAT(help.out, HasSubstr("--quiet")) << verb;
    const Outcome version = run({verb, "--version"});
    EXPECT_EQ(version.code, 0) << verb;
    EXPECT_THAT(version.out, HasSubstr("lightmill ")) << verb;
  }
}

TEST_F(Cli, WrongUsageIsOneLineAndExitCode2) {
  write("box.pbrt", kBox);
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"frobnicate"},
      {"render"},
      {"render", "box.pbrt", "--frobnicate"},
      {"render", "box.pbrt", "--spp", "-1"},
      {"render", "box.pbrt", "--spp", "0"},
      {"render", "box.pbrt", "--spp", "1.5"},
      {"render", "box.pbrt", "--spp", "many"},
      {"render", "box.pbrt", "--spp", "99999999999999999999"},
      {"render", "box.pbrt", "--time", "-3"},
      {"render", "box.pbrt", "--time", "nan"},
      {"render", "box.pbrt", "--target-error", "0"},
      {"render", "box.pbrt", "--max-depth", "deep"},
      {"render", "box.pbrt", "--max-depth", "-1"},
      {"render", "box.pbrt", "--seed", "-1"},
      {"render", "box.pbrt", "--threads", "-2"},
      {"render", "box.pbrt", "--threads", "5000"},
      {"render", "box.pbrt", "--integrator", "magic"},
      {"render", "box.pbrt", "--resolution", "64"},
      {"render", "box.pbrt", "--resolution", "0x64"},
      {"render", "box.pbrt", "--resolution", "64x64x64"},
      {"render", "box.pbrt", "--resolution", "100000x100000"},
      {"render", "box.pbrt", "--crop", "0,1,0"},
      {"render", "box.pbrt", "--crop", "0,1,0,1,0"},
      {"render", "box.pbrt", "--crop", "0.5,0.5,0,1"},
      {"render", "box.pbrt", "--crop", "0,2,0,1"},
      {"render", "box.pbrt", "--time-of", "nan"},
      {"render", "box.pbrt", "--time-of", "soon"},
      {"render", "box.pbrt", "--shutter", "0.5"},
      {"render", "box.pbrt", "--shutter", "0,x"},
      {"render", "box.pbrt", "--shutter", "0,inf"},
      {"render", "box.pbrt", "--shutter", "1,1"},
      {"render", "box.pbrt", "--shutter", "1,0"},
      {"render", "box.pbrt", "--fps", "0"},
      {"render", "box.pbrt", "--fps", "nan"},
      {"render", "box.pbrt", "-o", "box.docx"},
      {"render", "box.pbrt", "--half", "-o", "box.png"},
      {"render", "box.pbrt", "--aov", "albedo,colour"},
      {"render", "box.pbrt", "--aov", "albedo", "-o", "a.png"},
      {"render", "box.pbrt", "--view", "filmic", "-o", "a.exr"},
      {"render", "box.pbrt", "--view", "agx", "-o", "a.png"},
      {"render", "box.pbrt", "--exposure", "1000", "-o", "a.png"},
      {"render", "box.pbrt", "--plan", "box.pbrt"},
      {"render", "box.pbrt", "--plan-override", "textures=off"},
      {"jobs", "--tls-ca", "ca.pem"},
      {"jobs", "--token-file", "token"},
      {"jobs", "--coordinator", "no port here"},
      {"jobs", "--coordinator", "host.example:7070"},
      {"submit", "box.pbrt", "-o", "box.exr"},
      {"extend", "j1"},
      {"job"},
      {"fetch", "j1"},
      {"compare", "one.exr"},
  };
  for (const auto& arguments : wrong) {
    std::string line;
    for (const std::string& argument : arguments) line += argument + " ";
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 2) << line << outcome.err;
    EXPECT_THAT(outcome.out, IsEmpty()) << line;
    EXPECT_EQ(lines(outcome.err), 1) << line << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("lightmill: ")) << line;
  }
}

TEST_F(Cli, MissingFeaturesSaySo) {
  write("box.pbrt", kBox);
  EXPECT_THAT(run({"jobs", "--tls-ca", "x"}).err,
              HasSubstr("--tls-ca without --token-file: a secured connection takes all of"));
}

TEST_F(Cli, LayersAndViewsAreWritten) {
  write("box.pbrt", kBox);
  ASSERT_EQ(run({"render", "box.pbrt", "-q", "-o", "plain.exr"}).code, 0);
  const Outcome layered = run({"render", "box.pbrt", "-q", "--half", "--aov", "all", "-o", "layers.exr"});
  ASSERT_EQ(layered.code, 0) << layered.err;
  EXPECT_GT(std::filesystem::file_size("layers.exr"), std::filesystem::file_size("plain.exr"));
  EXPECT_THAT(run({"compare", "layers.exr", "plain.exr"}).out, HasSubstr("mean ratio"));
  ASSERT_EQ(run({"render", "box.pbrt", "-q", "-o", "a.png"}).code, 0);
  ASSERT_EQ(run({"render", "box.pbrt", "-q", "--view", "filmic", "--exposure", "-2", "-o", "b.png"}).code, 0);
  const auto sum = [](const char* path) {
    const Image image = read_image(path);
    return std::accumulate(image.data.begin(), image.data.end(), 0.0);
  };
  EXPECT_LT(sum("b.png"), sum("a.png"));
  EXPECT_GT(sum("b.png"), 0);
}

TEST_F(Cli, LightThatIsDroppedIsTold) {
  const auto render = [&](const std::string& limit) {
    write("sky.pbrt",
          "Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 16 \"float maxcomponentvalue\" " +
              limit + "\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [1 1 1]\n");
    return run({"render", "sky.pbrt", "-q", "--spp", "4", "--integrator", "pt", "--json", "--report",
                "report", "-o", "sky.exr"});
  };
  const Outcome capped = render("0.25");
  EXPECT_EQ(capped.code, 0);
  EXPECT_THAT(capped.err, HasSubstr("lightmill: warning: 2048 samples were brighter than the film's"));
  const nlohmann::json job = nlohmann::json::parse(capped.out);
  EXPECT_EQ(job["dropped"]["capped"]["count"], 2048);
  EXPECT_NEAR(job["dropped"]["capped"]["share"].get<double>(), 0.75, 0.05) << "XYZ's largest component is Z";
  EXPECT_EQ(job["nonfinite"], 0);
  std::ifstream report("report/report.html");
  const std::string html((std::istreambuf_iterator<char>(report)), std::istreambuf_iterator<char>());
  EXPECT_THAT(html, HasSubstr("Dropped light:</strong> 2048 samples"));
  const Outcome whole = render("100");
  EXPECT_THAT(whole.err, IsEmpty());
  EXPECT_EQ(nlohmann::json::parse(whole.out)["dropped"]["capped"]["share"], 0);
}

TEST_F(Cli, AnUnreachableCoordinatorIsNamedWithExitCode3) {
  for (const char* verb : {"jobs", "workers"}) {
    const Outcome outcome = run({verb, "--coordinator", "127.0.0.1:1"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_THAT(outcome.err, HasSubstr("127.0.0.1:1"));
    EXPECT_EQ(lines(outcome.err), 1);
  }
  for (const char* verb : {"job", "watch", "tiles", "pause", "resume", "cancel", "retry", "report"}) {
    EXPECT_EQ(run({verb, "j1", "--coordinator", "127.0.0.1:1"}).code, 3) << verb;
  }
  setenv("LIGHTMILL_COORDINATOR", "127.0.0.1:2", 1);
  EXPECT_THAT(run({"jobs"}).err, HasSubstr("127.0.0.1:2"));
}

TEST_F(Cli, AnOutputThatCannotBeWrittenIsExitCode1BeforeRendering) {
  write("box.pbrt", kBox);
  const Outcome outcome = run({"render", "box.pbrt", "--quiet", "-o", "/proc/none/x.exr"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(lines(outcome.err), 1);
  EXPECT_THAT(outcome.err, HasSubstr("/proc/none"));
}

TEST_F(Cli, RenderWritesToTheFilmsNameInTheCurrentFolder) {
  write("box.pbrt", kBox);
  const Outcome outcome = run({"render", "box.pbrt", "--quiet"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, IsEmpty());
  const Image image = read_image("box.exr");
  EXPECT_EQ(image.width, 40);
  EXPECT_EQ(image.height, 24);
}

TEST_F(Cli, RenderAsJson) {
  write("box.pbrt", kBox);
  const Outcome outcome = run({"render", "box.pbrt", "--json", "--quiet", "--crop", "0,0.5,0,1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto job = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(job["state"], "done");
  EXPECT_EQ(job["spp"], 2);
  EXPECT_EQ(job["packets_done"], job["packets_total"]);
  EXPECT_EQ(job["nonfinite"], 0);
  EXPECT_EQ(read_image(job["output"].get<std::string>()).width, 20);
}

TEST_F(Cli, ThreadsDoNotShowAndSeedsDo) {
  write("box.pbrt", kBox);
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(run({"render", "box.pbrt", "--quiet", "--spp", "20", "--threads", threads, "-o",
                   std::string("t") + threads + ".exr"})
                  .code,
              0);
  }
  ASSERT_EQ(run({"render", "box.pbrt", "--quiet", "--spp", "20", "--seed", "9", "-o", "s.exr"}).code, 0);
  EXPECT_EQ(read_image("t1.exr").data, read_image("t3.exr").data);
  EXPECT_NE(read_image("t1.exr").data, read_image("s.exr").data);
}

TEST_F(Cli, ReportHasItsThreeFilesAndTrueErrors) {
  write("box.pbrt", kBox);
  ASSERT_EQ(run({"render", "box.pbrt", "--quiet", "--spp", "512", "-o", "ref.exr"}).code, 0);
  ASSERT_EQ(run({"render", "box.pbrt", "--quiet", "--spp", "64", "--seed", "3", "--reference", "ref.exr",
                 "--report", "rep", "-o", "x.exr"})
                .code,
            0);
  for (const char* file : {"rep/error.csv", "rep/error.svg", "rep/report.html"}) {
    EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
  }
  const Outcome again = run({"report", "rep", "--json"});
  ASSERT_EQ(again.code, 0) << again.err;
  const auto curve = nlohmann::json::parse(again.out);
  ASSERT_FALSE(curve["points"].empty());
  EXPECT_TRUE(curve["points"].back().contains("relmse_16_high"));
  EXPECT_THAT(run({"report", "rep"}).out, HasSubstr("of 16 px"));
}

TEST_F(Cli, AReferenceOfAnotherSizeIsRefused) {
  write("box.pbrt", kBox);
  write_image(Image(8, 8), "small.exr");
  const Outcome outcome = run({"render", "box.pbrt", "--quiet", "--reference", "small.exr"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("8x8"));
}

TEST_F(Cli, CompareHasTheKeysOfTheContract) {
  Image a(16, 16), b(16, 16);
  std::fill(a.data.begin(), a.data.end(), 0.5f);
  std::fill(b.data.begin(), b.data.end(), 0.25f);
  write_image(a, "a.exr");
  write_image(b, "b.exr");
  const Outcome outcome = run({"compare", "a.exr", "b.exr", "--json"});
  ASSERT_EQ(outcome.code, 0);
  const auto metrics = nlohmann::json::parse(outcome.out);
  EXPECT_DOUBLE_EQ(metrics["mse"].get<double>(), 0.0625);
  EXPECT_DOUBLE_EQ(metrics["mean_ratio"].get<double>(), 2);
  for (const char* key : {"relmse", "relmse_trimmed", "mae", "flip"})
    EXPECT_GT(metrics[key].get<double>(), 0) << key;
  EXPECT_NEAR(metrics["relmse_4"].get<double>(), 16 * metrics["relmse"].get<double>(), 1e-9);
  EXPECT_NEAR(metrics["relmse_16"].get<double>(), 256 * metrics["relmse"].get<double>(), 1e-9);
  EXPECT_TRUE(metrics["relmse_32"].is_null()) << "no box fits";
  const std::string text = run({"compare", "a.exr", "b.exr"}).out;
  EXPECT_THAT(text, HasSubstr("relMSE of 16 px "));
  EXPECT_THAT(text, Not(HasSubstr("32 px")));
  write_image(Image(8, 8), "small.exr");
  EXPECT_EQ(run({"compare", "a.exr", "small.exr"}).code, 2);
  EXPECT_EQ(run({"compare", "a.exr", "none.exr"}).code, 1);
}

TEST_F(Cli, ExplainHasTheKeysOfTheContract) {
  write("box.pbrt", kBox);
  const Outcome outcome = run({"explain", "box.pbrt", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  bool needed = false, left_out = false;
  const auto document = nlohmann::json::parse(outcome.out);
  for (const auto& item : document["items"]) {
    EXPECT_FALSE(item["feature"].get<std::string>().empty());
    EXPECT_FALSE(item["reason"].get<std::string>().empty());
    EXPECT_TRUE(item["saving"].is_string());
    (item["needed"].get<bool>() ? needed : left_out) = true;
  }
  EXPECT_TRUE(needed && left_out);
  EXPECT_NO_THROW(pilot_from_json(document["pilot"].dump()));
  const auto without = nlohmann::json::parse(run({"explain", "box.pbrt", "--json", "--no-pilot"}).out);
  EXPECT_TRUE(without["pilot"].is_null());
  EXPECT_TRUE(nlohmann::json::parse(run({"explain", "box.pbrt", "--json", "--integrator", "pt"}).out)["pilot"]
                  .is_null());
  EXPECT_THAT(run({"explain", "box.pbrt"}).out, HasSubstr("chosen by a pilot"));
}

TEST_F(Cli, TinyAndOblongImagesWork) {
  write("box.pbrt", kBox);
  for (const char* size : {"1x1", "1x20000", "33x1"}) {
    const Outcome outcome =
        run({"render", "box.pbrt", "--quiet", "--spp", "1", "--resolution", size, "-o", "x.exr"});
    EXPECT_EQ(outcome.code, 0) << size << outcome.err;
  }
}

}  // namespace
}  // namespace lightmill::client
