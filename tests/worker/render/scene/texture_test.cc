// Texture conventions: v runs up, wraps, colour encodings, filtering, and the texture graph.
#include "worker/render/scene/texture.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>

#include "common/error.h"
#include "common/image/image.h"

namespace lightmill::test {
namespace {

class TextureTest : public ::testing::Test {
 protected:
  TextureTest() {
    std::string name = (std::filesystem::temp_directory_path() / "lightmill-texture-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  ~TextureTest() override { std::filesystem::remove_all(folder_); }

  /// A 2 x 2 picture with the top row first: (a b / c d), grey.
  ImageTexture picture(const std::string& name, float a, float b, float c, float d) {
    Image image(2, 2);
    const float values[4] = {a, b, c, d};
    for (size_t i = 0; i < 4; ++i) {
      for (size_t k = 0; k < 3; ++k) image.data[3 * i + k] = values[i];
    }
    ImageTexture t;
    t.path = (folder_ / name).string();
    write_image(image, t.path);
    return t;
  }
  std::filesystem::path folder_;
};

TEST_F(TextureTest, TheFirstRowIsAtTheTopOfV) {
  const ImageMap map(picture("a.exr", 1, 2, 3, 4));
  EXPECT_FLOAT_EQ(map.lookup(0.25f, 0.75f).r, 1);
  EXPECT_FLOAT_EQ(map.lookup(0.75f, 0.75f).r, 2);
  EXPECT_FLOAT_EQ(map.lookup(0.25f, 0.25f).r, 3);
  EXPECT_FLOAT_EQ(map.lookup(0.75f, 0.25f).r, 4);
}

TEST_F(TextureTest, BilinearBetweenTexelCentres) {
  const ImageMap map(picture("a.exr", 0, 4, 0, 4));
  EXPECT_NEAR(map.lookup(0.5f, 0.75f).r, 2, 1e-6);
  EXPECT_NEAR(map.lookup(0.375f, 0.3f).r, 1, 1e-6);
}

TEST_F(TextureTest, Wraps) {
  ImageTexture t = picture("a.exr", 1, 2, 3, 4);
  t.wrap = Wrap::kRepeat;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(1.25f, 0.75f).r, 1);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(-0.75f, -0.25f).r, 1);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0, 0.75f).r, 1.5f);  // the seam blends both sides
  t.wrap = Wrap::kClamp;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(1.9f, 2.75f).r, 2);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(-7, -3).r, 3);
  t.wrap = Wrap::kBlack;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(2.5f, 0.75f).r, 0);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.25f, 0.75f).r, 1);
}

TEST_F(TextureTest, EightBitFilesAreSrgbUnlessSaidOtherwise) {
  // write_image encodes PNG as sRGB: the round trip is the identity up to 8 bits.
  ImageTexture t = picture("a.png", 0.5f, 0.5f, 0.5f, 0.5f);
  EXPECT_NEAR(ImageMap(t).lookup(0.3f, 0.3f).g, 0.5f, 0.004f);
  t.encoding = ColorEncoding::kLinear;
  EXPECT_NEAR(ImageMap(t).lookup(0.3f, 0.3f).g, linear_to_srgb(0.5f), 0.003f);
  t.encoding = ColorEncoding::kGamma;
  t.gamma = 2.2f;
  EXPECT_NEAR(ImageMap(t).lookup(0.3f, 0.3f).g, std::pow(linear_to_srgb(0.5f), 2.2f), 0.004f);
}

TEST_F(TextureTest, FloatFilesAreLinearUnlessSaidOtherwise) {
  ImageTexture t = picture("a.exr", 0.5f, 0.5f, 0.5f, 0.5f);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).b, 0.5f);
  t.encoding = ColorEncoding::kSrgb;
  EXPECT_NEAR(ImageMap(t).lookup(0.3f, 0.3f).b, srgb_to_linear(0.5f), 1e-5f);
}

TEST_F(TextureTest, ScaleAndInvert) {
  ImageTexture t = picture("a.exr", 0.25f, 0.25f, 0.25f, 0.25f);
  t.scale = 2;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).r, 0.5f);
  t.invert = true;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).r, 0.5f);
  t.scale = 8;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).r, 0);
}

TEST_F(TextureTest, MappingScalesAndShifts) {
  ImageTexture t = picture("a.exr", 1, 2, 3, 4);
  t.mapping = {2, -1, 0.25f, 1};
  TextureDescription d;
  d.kind = t;
  const TextureTable table({d});
  EXPECT_FLOAT_EQ(table.evaluate(0, {0, 0.75f}).r, 3);  // (s, t) = (0.25, 0.25)
}

TEST_F(TextureTest, BadFilesAreRefusedInOneLine) {
  ImageTexture t;
  t.path = (folder_ / "absent.png").string();
  EXPECT_THROW(ImageMap{t}, Error);
}

TEST_F(TextureTest, CoordinatesOutOfAnyRangeAreDefined) {
  const ImageMap map(picture("a.exr", 1, 2, 3, 4));
  for (const float x : {1e30f, -1e30f, INFINITY, NAN}) {
    const float r = map.lookup(x, 0.5f).r;
    EXPECT_TRUE(r >= 1 && r <= 4) << x;
  }
}

TEST(TextureGraph, ConstantScaleMixCheckerboard) {
  std::vector<TextureDescription> t(4);
  t[0].kind = ConstantTexture{{0.2f, 0.4f, 0.6f}};
  t[1].kind = ScaleTexture{{{}, 0}, {0.5f, -1}};
  t[2].kind = MixTexture{{{1, 1, 1}, -1}, {{}, 1}, {0.25f, -1}};
  t[3].kind = CheckerboardTexture{{{1, 0, 0}, -1}, {{}, 2}, {2, 2, 0, 0}};
  const TextureTable table(t);
  EXPECT_FLOAT_EQ(table.evaluate(1, {0, 0}).g, 0.2f);
  EXPECT_FLOAT_EQ(table.evaluate(2, {0, 0}).r, 0.75f + 0.25f * 0.1f);
  EXPECT_FLOAT_EQ(table.evaluate(3, {0.1f, 0.1f}).g, 0);
  EXPECT_FLOAT_EQ(table.evaluate(3, {0.6f, 0.1f}).g, 0.75f + 0.25f * 0.2f);
  EXPECT_FLOAT_EQ(table.evaluate(3, {0.6f, 0.7f}).g, 0);
  EXPECT_FLOAT_EQ(table.evaluate(3, {-0.1f, 0.1f}).g, 0.75f + 0.25f * 0.2f);
}

}  // namespace
}  // namespace lightmill::test
