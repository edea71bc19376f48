// Views of OpenColorIO configurations and colour spaces of an .exr, from the command line to the file.
#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "tests/client/cli_fixture.h"
#include "tests/common/image/ocio_config.h"

namespace lightmill::client {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kBox;
using ::testing::Not;
using testing::Outcome;

class Colors : public testing::CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    write("box.pbrt", kBox);
    write("c.ocio", lightmill::testing::ocio_config());
  }
  void TearDown() override {
    unsetenv("OCIO");
    CliTest::TearDown();
  }
  Outcome render(const std::vector<std::string>& options, const std::string& path) {
    std::vector<std::string> command = {"render", "box.pbrt", "-q", "-o", path};
    command.insert(command.end(), options.begin(), options.end());
    return run(command);
  }
  double relmse(const std::string& a, const std::string& b) {
    const Outcome outcome = run({"compare", a, b, "--json"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["relmse"].get<double>();
  }
};

/// The file's bytes: what is read of it is taken for sRGB.
std::vector<int> bytes_of(const std::string& path) {
  std::vector<int> bytes;
  for (const float x : read_image(path).data)
    bytes.push_back(static_cast<int>(std::lround(255 * linear_to_srgb(x))));
  return bytes;
}

TEST_F(Colors, AViewOfTheConfigurationMakesThePng) {
  ASSERT_EQ(render({}, "a.exr").code, 0);
  const Outcome outcome = render({"--ocio", "c.ocio", "--view", "Swap", "--exposure", "1"}, "a.png");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Image image = read_image("a.exr");
  const std::vector<int> bytes = bytes_of("a.png");
  ASSERT_EQ(bytes.size(), image.data.size());
  // Halved, brightened by a stop, green first.
  for (size_t i = 0; i < bytes.size(); ++i) {
    const float x = image.data[i % 3 == 0 ? i + 1 : i % 3 == 1 ? i - 1 : i];
    ASSERT_NEAR(static_cast<float>(bytes[i]), 255 * std::min(x, 1.0f), 0.51) << i;
  }
  ASSERT_EQ(render({"--ocio", "c.ocio", "--view", "Projector/View/2", "--exposure", "1"}, "b.png").code, 0);
  EXPECT_EQ(bytes_of("b.png"), bytes);
}

TEST_F(Colors, OursStayWhereTheConfigurationHasNone) {
  ASSERT_EQ(render({}, "srgb.png").code, 0);
  ASSERT_EQ(render({"--view", "filmic"}, "filmic.png").code, 0);
  ASSERT_EQ(render({"--view", "aces"}, "aces.png").code, 0);
  setenv("OCIO", "c.ocio", 1);
  ASSERT_EQ(render({}, "srgb2.png").code, 0);
  EXPECT_EQ(bytes_of("srgb2.png"), bytes_of("srgb.png")) << "without --view the variable changes nothing";
  ASSERT_EQ(render({"--view", "aces"}, "aces2.png").code, 0);
  EXPECT_EQ(bytes_of("aces2.png"), bytes_of("aces.png"));
  ASSERT_EQ(render({"--view", "filmic"}, "filmic2.png").code, 0);
  EXPECT_NE(bytes_of("filmic2.png"), bytes_of("filmic.png")) << "the configuration has one of that name";
  ASSERT_EQ(render({"--view", "Root"}, "root.png").code, 0);
  EXPECT_NE(bytes_of("root.png"), bytes_of("srgb.png"));
  setenv("OCIO", "", 1);
  ASSERT_EQ(render({"--view", "filmic"}, "filmic3.png").code, 0);
  EXPECT_EQ(bytes_of("filmic3.png"), bytes_of("filmic.png"));
}

TEST_F(Colors, DenoiseTakesThemToo) {
  ASSERT_EQ(render({"--aov", "denoise"}, "a.exr").code, 0);
  ASSERT_EQ(run({"denoise", "a.exr", "-q", "-o", "a.png"}).code, 0);
  ASSERT_EQ(run({"denoise", "a.exr", "-q", "-o", "b.png", "--ocio", "c.ocio", "--view", "Swap"}).code, 0);
  EXPECT_NE(bytes_of("a.png"), bytes_of("b.png"));
}

TEST_F(Colors, WhatIsWrongIsOneLine) {
  write("bad.ocio", "no configuration");
  struct Case {
    std::vector<std::string> options;
    std::string path;
    int code;
    const char* says;
  };
  const Case cases[] = {
      {{"--view", "Swap"}, "a.png", 2, "srgb, filmic, aces and none; those of an OpenColorIO"},
      {{"--view", "swap", "--ocio", "c.ocio"},
       "a.png",
       2,
       "none, and of the configuration: Root, Swap, filmic, Projector/Root, Projector/View/2"},
      {{"--view", "", "--ocio", "c.ocio"}, "a.png", 2, "--view : there is"},
      {{"--ocio", "c.ocio"}, "a.png", 2, "name one of its views by --view: Root, Swap"},
      {{"--view", "Swap", "--ocio", "bad.ocio"}, "a.png", 1, "bad.ocio: it can't be read as an OpenColorIO"},
      {{"--view", "Swap", "--ocio", "none.ocio"}, "a.png", 1, "none.ocio: there is no such file"},
      {{"--view", "Swap", "--ocio", "c.ocio"}, "a.exr", 2, "they are for .png"},
      {{"--colorspace", "p3"}, "a.exr", 2, "--colorspace"},
      {{"--colorspace", "acescg"}, "a.png", 2, "--colorspace: only .exr files"},
      {{"--colorspace", "acescg"}, "a.pfm", 2, "--colorspace: only .exr files"},
  };
  for (const Case& c : cases) {
    const Outcome outcome = render(c.options, c.path);
    EXPECT_EQ(outcome.code, c.code) << c.says;
    EXPECT_THAT(outcome.err, HasSubstr(c.says));
    EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
  }
  setenv("OCIO", "bad.ocio", 1);
  EXPECT_THAT(render({"--view", "aces"}, "a.png").err,
              AllOf(HasSubstr("bad.ocio"), HasSubstr("$OCIO names it")));
  EXPECT_EQ(render({}, "a.png").code, 0);
}

TEST_F(Colors, AnExrInAcescgIsTheSamePicture) {
  ASSERT_EQ(render({"--aov", "direct,normal"}, "a.exr").code, 0);
  ASSERT_EQ(render({"--aov", "direct,normal", "--colorspace", "acescg"}, "b.exr").code, 0);
  EXPECT_EQ(read_image_space("a.exr"), ImageSpace::kRec709);
  EXPECT_EQ(read_image_space("b.exr"), ImageSpace::kAcesCg);
  EXPECT_LT(relmse("b.exr", "a.exr"), 1e-10);
  const ChannelImage a = read_channels("a.exr", 100000), b = read_channels("b.exr", 100000);
  ASSERT_EQ(a.channels, b.channels);
  for (size_t i = 0; i < a.image.data.size(); ++i)
    ASSERT_NEAR(a.image.data[i], b.image.data[i], 1e-5 * (1 + std::abs(a.image.data[i]))) << i;
}

TEST_F(Colors, TheVarianceIsLeftOutWithAWarning) {
  const Outcome outcome =
      run({"render", "box.pbrt", "--aov", "variance,direct", "--colorspace", "rec2020", "-o", "a.exr"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("the layer variance is left out of a.exr"));
  EXPECT_THAT(read_channels("a.exr", 100000).channels,
              AllOf(Contains("direct.R"), Not(Contains("variance.R"))));
  EXPECT_THAT(render({"--aov", "variance", "--colorspace", "rec2020"}, "b.exr").err, IsEmpty());
}

TEST_F(Colors, ADenoisedImageKeepsItsSpace) {
  ASSERT_EQ(render({"--aov", "denoise"}, "a.exr").code, 0);
  ASSERT_EQ(render({"--aov", "denoise", "--colorspace", "acescg"}, "b.exr").code, 0);
  ASSERT_EQ(run({"denoise", "a.exr", "-q", "-o", "clean_a.exr"}).code, 0);
  ASSERT_EQ(run({"denoise", "b.exr", "-q", "-o", "clean_b.exr"}).code, 0);
  ASSERT_EQ(run({"denoise", "b.exr", "-q", "-o", "clean_c.exr", "--colorspace", "rec709"}).code, 0);
  ASSERT_EQ(run({"denoise", "b.exr", "-q", "-o", "clean_d.pfm"}).code, 0);
  EXPECT_EQ(read_image_space("clean_a.exr"), ImageSpace::kRec709);
  EXPECT_EQ(read_image_space("clean_b.exr"), ImageSpace::kAcesCg);
  EXPECT_EQ(read_image_space("clean_c.exr"), ImageSpace::kRec709);
  for (const char* other : {"clean_b.exr", "clean_c.exr", "clean_d.pfm"})
    EXPECT_LT(relmse(other, "clean_a.exr"), 1e-6) << other;
}

}  // namespace
}  // namespace lightmill::client
