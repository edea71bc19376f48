// `lightmill denoise` from a render to a file, and what it says of files that it can't use.
#include <gmock/gmock.h>

#include <algorithm>

#include "common/image/image.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class DenoiseVerb : public testing::CliTest {};

TEST_F(DenoiseVerb, TakesWhatARenderRecords) {
  const std::string scene = write("box.pbrt", testing::kBox);
  ASSERT_EQ(run({"render", scene, "--spp", "4", "--aov", "denoise", "-o", "noisy.exr", "--quiet"}).code, 0);
  const testing::Outcome outcome = run({"denoise", "noisy.exr", "-o", "clean.exr", "--json"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("\"difference\": true"));
  const ChannelImage clean = read_channels("clean.exr", 1000000);
  for (const char* channel :
       {"R", "raw.R", "error.V", "albedo.G", "depth.Z", "difference.B", "normal_difference.X"}) {
    EXPECT_THAT(clean.channels, Contains(channel));
  }
  EXPECT_EQ(run({"denoise", "clean.exr", "-o", "again.png", "--view", "filmic", "--quiet"}).code, 0);
}

// The layers need no asking for, and the file need not be able to hold them.
TEST_F(DenoiseVerb, ARenderDenoisesAsTheVerbDoes) {
  const std::string scene = write("box.pbrt", testing::kBox);
  ASSERT_EQ(run({"render", scene, "--spp", "4", "--aov", "denoise", "-o", "noisy.exr", "--quiet"}).code, 0);
  ASSERT_EQ(run({"denoise", "noisy.exr", "-o", "two.pfm", "--quiet"}).code, 0);
  const testing::Outcome outcome =
      run({"render", scene, "--spp", "4", "--denoise", "-o", "one.pfm", "--json", "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\"denoised\": {"));
  EXPECT_EQ(read_image("one.pfm").data, read_image("two.pfm").data);
  ASSERT_EQ(run({"render", scene, "--spp", "4", "--denoise", "-o", "one.exr", "--quiet"}).code, 0);
  EXPECT_EQ(read_image("one.exr").data, read_image("two.pfm").data);
  EXPECT_THAT(read_channels("one.exr", 1000000).channels, Contains("raw.R"));
  EXPECT_NE(read_image_metadata("one.exr", "denoised_relmse"), "");
  EXPECT_NE(read_image_metadata("one.exr", "spp"), "");
}

TEST_F(DenoiseVerb, WarnsOfLayersThatLack) {
  write_image(Image(8, 4), "plain.exr");
  const testing::Outcome outcome = run({"denoise", "plain.exr", "-o", "clean.exr"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("no layer albedo, normal, depth"));
  EXPECT_THAT(outcome.err, HasSubstr("--aov denoise"));
}

TEST_F(DenoiseVerb, SaysInOneLineWhatIsWrong) {
  write_image(Image(8, 4), "bytes.png");
  write_image(Image(8, 4), "plain.exr");
  write("text.exr", "no image");
  const std::vector<std::pair<std::vector<std::string>, const char*>> wrong = {
      {{"denoise", "plain.exr"}, "-o is required"},
      {{"denoise", "absent.exr", "-o", "a.exr"}, "no such file"},
      {{"denoise", "text.exr", "-o", "a.exr"}, "can't read"},
      {{"denoise", "bytes.png", "-o", "a.exr"}, "does not hold floats"},
      {{"denoise", "plain.exr", "-o", "nowhere/a.exr"}, "no folder"},
      {{"denoise", "plain.exr", "-o", "a.pfm", "--half"}, "--half"},
  };
  for (const auto& [command, says] : wrong) {
    const testing::Outcome outcome = run(command);
    EXPECT_NE(outcome.code, 0) << says;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

}  // namespace
}  // namespace lightmill::client
