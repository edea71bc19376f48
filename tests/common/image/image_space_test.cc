// The spaces that an .exr can be written in: their matrices against published figures, and files in and out.
#include "common/image/image_space.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/base/error.h"
#include "common/image/color_channels.h"
#include "common/image/image.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TempFolder;

constexpr ImageSpace kEverySpace[] = {ImageSpace::kRec709, ImageSpace::kAcesCg, ImageSpace::kAces2065,
                                      ImageSpace::kRec2020};

RgbMatrix from_rec709(ImageSpace space) {
  return rgb_conversion(kRec709Primaries, primaries_of(space)).value();
}

void expect_near(const RgbMatrix& m, const RgbMatrix& published, double tolerance) {
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) EXPECT_NEAR(m[i][j], published[i][j], tolerance) << i << "," << j;
  }
}

// The matrices of OpenColorIO's built-in transforms and of the ACES configurations; Rec.2020: ITU-R
// BT.2087-0.
TEST(ImageSpace, MatricesAreThePublishedOnes) {
  expect_near(
      from_rec709(ImageSpace::kAcesCg),
      {{{0.613097, 0.339523, 0.047379}, {0.070194, 0.916354, 0.013452}, {0.020616, 0.109570, 0.869815}}},
      2e-6);
  expect_near(
      from_rec709(ImageSpace::kAces2065),
      {{{0.439633, 0.382989, 0.177378}, {0.089776, 0.813439, 0.096784}, {0.017541, 0.111547, 0.870912}}},
      2e-5);
  expect_near(from_rec709(ImageSpace::kRec2020),
              {{{0.6274, 0.3293, 0.0433}, {0.0691, 0.9195, 0.0114}, {0.0164, 0.0880, 0.8956}}}, 5e-5);
  expect_near(from_rec709(ImageSpace::kRec709), {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1e-12);
}

TEST(ImageSpace, WhiteStaysWhiteAndTheWayBackIsTheInverse) {
  for (const ImageSpace space : kEverySpace) {
    float white[] = {3, 3, 3}, color[] = {0.9f, 0.1f, 0.4f};
    convert_color(from_rec709(space), white);
    for (const float x : white) EXPECT_NEAR(x, 3, 1e-6) << image_space_name(space);
    convert_color(from_rec709(space), color);
    convert_color(rgb_conversion(primaries_of(space), kRec709Primaries).value(), color);
    EXPECT_THAT(color, ElementsAre(::testing::FloatNear(0.9f, 1e-6f), ::testing::FloatNear(0.1f, 1e-6f),
                                   ::testing::FloatNear(0.4f, 1e-6f)));
    EXPECT_EQ(image_space_named(image_space_name(space)), space);
    EXPECT_EQ(image_space_of(primaries_of(space)), space);
  }
  EXPECT_THROW(image_space_named("p3"), Error);
}

TEST(ImageSpace, PrimariesThatAreNoneConvertNothing) {
  const RgbPrimaries zero{};
  RgbPrimaries line = kRec709Primaries, dark = kRec709Primaries, outside = kRec709Primaries,
               number = kRec709Primaries;
  line.green = {0.395, 0.195};
  dark.white = {0.3127, 0};
  outside.white = {0.7, 0.2};
  number.red[0] = std::numeric_limits<double>::quiet_NaN();
  for (const RgbPrimaries& p : {zero, line, dark, outside, number}) {
    EXPECT_FALSE(rgb_conversion(p, kRec709Primaries));
    EXPECT_FALSE(rgb_conversion(kRec709Primaries, p));
    EXPECT_FALSE(are_same(p, kRec709Primaries));
  }
  const RgbPrimaries xyz{{1, 0}, {0, 1}, {0, 0}, {1 / 3.0, 1 / 3.0}};
  EXPECT_TRUE(rgb_conversion(xyz, kRec709Primaries)) << "primaries of no luminance are primaries";
}

/// One pixel: colour, layers of every kind.
ChannelImage some_layers() {
  ChannelImage layers{
      Image(1, 1, 13),
      {"A", "direct.R", "direct.G", "direct.B", "normal.X", "variance.R", "variance.G", "variance.B",
       "lightgroup_key.R", "lightgroup_key.G", "lightgroup_key.B", "depth.Z", "samples.V"}};
  layers.image.data = {0.5f, 1, 0, 0, 0.25f, 7, 8, 9, 0, 1, 0, 12, 16};
  return layers;
}

TEST(ImageSpace, ColoursOfAFileAreConvertedAndItsHeaderSaysSo) {
  const TempFolder folder;
  Image image(1, 1);
  image.data = {0.9f, 0.1f, 0.4f};
  const ChannelImage layers = some_layers();
  const char* const ids[] = {"lin_rec709_scene", "lin_ap1_scene", "lin_ap0_scene", "lin_rec2020_scene"};
  for (const ImageSpace space : kEverySpace) {
    const std::string path = folder / (image_space_name(space) + ".exr");
    write_image(image, path, {.layers = &layers, .space = space});
    const auto in = OIIO::ImageInput::open(path);
    ASSERT_TRUE(in);
    std::array<float, 8> xy{};
    ASSERT_TRUE(
        in->spec().getattribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), xy.data()));
    EXPECT_EQ(xy[2], static_cast<float>(primaries_of(space).green[0]));
    EXPECT_EQ(xy[7], static_cast<float>(primaries_of(space).white[1]));
    EXPECT_EQ(in->spec().get_string_attribute("colorInteropID"), ids[static_cast<size_t>(space)]);
    EXPECT_EQ(read_image_space(path), space);

    const bool converted = space != ImageSpace::kRec709;
    const auto channel = [&](const std::string& name) {
      const auto& names = in->spec().channelnames;
      const auto at = static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
      float value = -1;
      if (at < static_cast<int>(names.size()))
        in->read_image(0, 0, at, at + 1, OIIO::TypeDesc::FLOAT, &value);
      return value;
    };
    float color[] = {0.9f, 0.1f, 0.4f};
    if (converted) convert_color(from_rec709(space), color);
    EXPECT_EQ(channel("R"), color[0]);
    EXPECT_EQ(channel("B"), color[2]);
    EXPECT_NEAR(channel("direct.G"), from_rec709(space)[1][0], 1e-7);
    EXPECT_NEAR(channel("lightgroup_key.R"), from_rec709(space)[0][1], 1e-7);
    EXPECT_EQ(channel("A"), 0.5f);
    EXPECT_EQ(channel("normal.X"), 0.25f);
    EXPECT_EQ(channel("depth.Z"), 12);
    EXPECT_EQ(channel("samples.V"), 16);
    EXPECT_EQ(channel("variance.G"), converted ? -1 : 8) << "squares of other primaries are not known";

    const Image back = read_image(path);
    const ChannelImage all = read_channels(path, 1);
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(back.data[c], image.data[c], converted ? 1e-6 : 0);
      EXPECT_EQ(all.image.data[c], back.data[c]);
    }
  }
}

TEST(ImageSpace, AFileWithoutColoursOfItsOwnIsAsBefore) {
  const TempFolder folder;
  Image grey(2, 1, 1);
  grey.data = {0.25f, 4};
  write_image(grey, folder / "grey.exr", {.space = ImageSpace::kAcesCg});
  EXPECT_EQ(read_image(folder / "grey.exr").data, (std::vector<float>{0.25f, 0.25f, 0.25f, 4, 4, 4}));
  write_image(Image(2, 1), folder / "a.pfm");
  EXPECT_EQ(read_image_space(folder / "a.pfm"), ImageSpace::kRec709);
}

void write_with_chromaticities(const std::string& path, const std::array<float, 8>& xy) {
  const auto out = OIIO::ImageOutput::create(path);
  OIIO::ImageSpec spec(1, 1, 3, OIIO::TypeDesc::FLOAT);
  spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), xy.data());
  const float pixel[] = {0.2f, 0.3f, 0.4f};
  ASSERT_TRUE(out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, pixel) && out->close());
}

TEST(ImageSpace, PrimariesOfOtherProgramsAreHeeded) {
  const TempFolder folder;
  // Rec.709 as some round it: no bit changes. P3 is none of ours to write, and can be read.
  write_with_chromaticities(folder / "a.exr", {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.31271f, 0.32902f});
  EXPECT_EQ(read_image(folder / "a.exr").data, (std::vector<float>{0.2f, 0.3f, 0.4f}));
  write_with_chromaticities(folder / "p3.exr", {0.68f, 0.32f, 0.265f, 0.69f, 0.15f, 0.06f, 0.3127f, 0.329f});
  EXPECT_EQ(read_image_space(folder / "p3.exr"), std::nullopt);
  // P3 to Rec.709: 1.2249 -0.2249 0 / -0.0420 1.0420 0 / -0.0196 -0.0786 1.0983.
  EXPECT_NEAR(read_image(folder / "p3.exr").data[0], 1.2249 * 0.2 - 0.2249 * 0.3, 1e-4);
  write_with_chromaticities(folder / "none.exr", {});
  for (const auto& read : {+[](const std::string& path) { read_image(path); },
                           +[](const std::string& path) { read_channels(path, 1); }}) {
    try {
      read(folder / "none.exr");
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::kFailed);
      EXPECT_THAT(e.what(), HasSubstr("none.exr: can't read the image: its chromaticities"));
    }
  }
}

TEST(ImageSpace, LayersOfOtherProgramsThatHoldNoColoursStay) {
  ChannelImage file{Image(1, 1, 15),
                    {"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "N.R", "N.G",
                     "N.B", "CryptoObject00.r", "CryptoObject00.g", "CryptoObject00.b", "normal_difference.R",
                     "normal_difference.G", "normal_difference.B", "half.R", "half.G", "Variance.R"}};
  file.image.data.assign(15, 0);
  for (size_t i = 0; i < 15; i += 3) file.image.data[i] = 1;
  convert_colors(&file, from_rec709(ImageSpace::kAcesCg));
  ASSERT_EQ(file.channels.size(), 14u) << "the variance is gone";
  ASSERT_EQ(file.image.channels, 14);
  EXPECT_NEAR(file.image.data[0], 0.613097, 2e-6);
  EXPECT_NEAR(file.image.data[1], 0.070194, 2e-6);
  for (size_t i = 3; i < 14; ++i) EXPECT_EQ(file.image.data[i], i % 3 == 0 ? 1 : 0) << file.channels[i];
}

}  // namespace
}  // namespace lightmill
