// Texture conventions: v runs up, wraps, colour encodings, filtering, and the texture graph.
#include "worker/render/scene/textures/texture.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <webp/encode.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/base/error.h"
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

TEST_F(TextureTest, ATableReadByThreadsIsTheSameAndItsFirstErrorIsReported) {
  std::vector<TextureDescription> textures;
  for (int i = 0; i < 20; ++i) {
    const std::string name = std::to_string(i) + ".exr";
    textures.push_back({name, true, picture(name, static_cast<float>(i), 0, 0, 0), {"scene.pbrt", i + 1, 1}});
  }
  for (const int threads : {1, 4}) {
    const TextureTable table(textures, threads);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(table.evaluate(i, {0.25f, 0.75f}).r, static_cast<float>(i));
  }
  for (const int broken : {7, 8, 15}) {
    std::ofstream(folder_ / (std::to_string(broken) + ".exr"), std::ios::trunc) << "nothing";
  }
  for (int run = 0; run < 20; ++run) {
    try {
      TextureTable(textures, 4);
      FAIL() << "broken images were read";
    } catch (const Error& e) {
      EXPECT_EQ(std::string(e.what()).rfind("scene.pbrt:8:1: ", 0), 0u) << e.what();
    }
  }
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

TEST_F(TextureTest, FloatFilesAreLinearWhateverIsSaid) {
  ImageTexture t = picture("a.exr", 0.5f, 0.5f, 0.5f, 0.5f);
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).b, 0.5f);
  t.encoding = ColorEncoding::kSrgb;
  EXPECT_FLOAT_EQ(ImageMap(t).lookup(0.3f, 0.3f).b, 0.5f) << "as in pbrt";
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

/// A PNG of two RGBA texels, (255 128 0 128) and (0 64 255 255), as bytes inside another file.
ImageTexture embedded() {
  static constexpr unsigned char kPng[] = {
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
      0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x06, 0x00, 0x00, 0x00, 0xf4,
      0x22, 0x7f, 0x8a, 0x00, 0x00, 0x00, 0x11, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0xf8,
      0xdf, 0xc0, 0xd0, 0xc0, 0xe0, 0xf0, 0xff, 0x3f, 0x00, 0x11, 0xbe, 0x04, 0x3e, 0x13, 0xfa,
      0x05, 0x76, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  ImageTexture t;
  t.path = "scene.glb/images/0.png";
  t.contents = std::make_shared<const std::string>(reinterpret_cast<const char*>(kPng), sizeof kPng);
  t.encoding = ColorEncoding::kLinear;
  return t;
}

TEST(EmbeddedTexture, ChannelsAreTakenAsTheyAreStored) {
  ImageTexture t = embedded();
  const Rgb c = ImageMap(t).lookup(0.25f, 0.5f);
  EXPECT_FLOAT_EQ(c.r, 1) << "not multiplied by alpha";
  EXPECT_FLOAT_EQ(c.g, 128 / 255.0f);
  const std::pair<ImageChannel, int> channels[] = {{ImageChannel::kRed, 255},
                                                   {ImageChannel::kGreen, 128},
                                                   {ImageChannel::kBlue, 0},
                                                   {ImageChannel::kAlpha, 128}};
  for (const auto& [channel, value] : channels) {
    t.channel = channel;
    const Rgb grey = ImageMap(t).lookup(0.25f, 0.5f);
    EXPECT_FLOAT_EQ(grey.r, static_cast<float>(value) / 255.0f);
    EXPECT_EQ(grey.r, grey.b);
  }
  t.contents = std::make_shared<const std::string>(t.contents->substr(0, 40));
  EXPECT_THROW(ImageMap{t}, Error);
}

/// The same texels as embedded(), as a WebP file.
ImageTexture webp() {
  constexpr uint8_t kTexels[] = {255, 128, 0, 128, 0, 64, 255, 255};
  uint8_t* file = nullptr;
  const size_t size = WebPEncodeLosslessRGBA(kTexels, 2, 1, 8, &file);
  ImageTexture t = embedded();
  t.path = "scene.glb/images/0.webp";
  t.contents = std::make_shared<const std::string>(reinterpret_cast<const char*>(file), size);
  WebPFree(file);
  return t;
}

TEST(EmbeddedTexture, WebpIsTakenAsItIsStored) {
  for (const ImageChannel channel : {ImageChannel::kRgb, ImageChannel::kRed, ImageChannel::kGreen,
                                     ImageChannel::kBlue, ImageChannel::kAlpha}) {
    ImageTexture png = embedded(), same = webp();
    png.channel = same.channel = channel;
    for (const float s : {0.25f, 0.5f, 0.75f}) {
      const Rgb a = ImageMap(png).lookup(s, 0.5f), b = ImageMap(same).lookup(s, 0.5f);
      EXPECT_EQ(a, b) << static_cast<int>(channel) << " at " << s;
    }
    EXPECT_EQ(ImageMap::bytes_needed(png), ImageMap::bytes_needed(same));
  }
  ImageTexture cut = webp();
  for (const size_t size : {cut.contents->size() - 4, size_t{20}, size_t{0}}) {
    cut.contents = std::make_shared<const std::string>(cut.contents->substr(0, size));
    EXPECT_THROW(ImageMap{cut}, Error) << size;
  }
  cut.contents = nullptr;
  EXPECT_THROW(ImageMap{cut}, Error) << "no such file";
}

TEST(EmbeddedTexture, MirrorsPerAxisAndTheNearestTexel) {
  ImageTexture t = embedded();
  t.channel = ImageChannel::kBlue;
  t.filter = TexelFilter::kNearest;
  t.wrap = Wrap::kMirror;
  t.wrap_t = Wrap::kClamp;
  const ImageMap map(t);
  EXPECT_FLOAT_EQ(map.lookup(0.45f, 0.5f).r, 0);
  EXPECT_FLOAT_EQ(map.lookup(0.55f, 7.5f).r, 1);
  EXPECT_FLOAT_EQ(map.lookup(1.25f, 0.5f).r, 1);
  EXPECT_FLOAT_EQ(map.lookup(1.75f, 0.5f).r, 0);
  EXPECT_FLOAT_EQ(map.lookup(-0.75f, 0.5f).r, 1);
}

// A uniform cubic B-spline: flat stays flat, a step is 1/6, 1/2, 5/6 around its middle.
TEST(EmbeddedTexture, CubicIsABSpline) {
  ImageTexture t = embedded();
  t.channel = ImageChannel::kBlue;
  t.wrap = Wrap::kClamp;
  const ImageMap plain(t);
  ASSERT_FLOAT_EQ(plain.lookup(0.25f, 0.5f).r, 0);
  ASSERT_FLOAT_EQ(plain.lookup(0.75f, 0.5f).r, 1);
  t.filter = TexelFilter::kCubic;
  const ImageMap map(t);
  EXPECT_NEAR(map.lookup(0.25f, 0.5f).r, 1.0f / 6, 1e-6f);
  EXPECT_NEAR(map.lookup(0.5f, 0.5f).r, 0.5f, 1e-6f);
  EXPECT_NEAR(map.lookup(0.75f, 0.5f).r, 5.0f / 6, 1e-6f);
  EXPECT_NEAR(map.lookup(3, 0.5f).r, 1, 1e-6f);
  EXPECT_NEAR(map.lookup(-3, 0.5f).r, 0, 1e-6f);
}

TEST(TextureGraph, ProductsStepsAndVertexColours) {
  std::vector<TextureDescription> t(4);
  t[0].kind = VertexColorTexture{};
  t[1].kind = ProductTexture{{{}, 0}, {{0.5f, 2, 1}, -1}};
  t[2].kind = VertexColorTexture{true};
  t[3].kind = StepTexture{{0, 2}, 0.25f};
  const TextureTable table(t);
  TexturePoint at;
  at.color = {0.5f, 0.25f, 1, 0.25f};
  EXPECT_EQ(table.evaluate(1, at), (Rgb{0.25f, 0.5f, 1}));
  EXPECT_EQ(table.evaluate(3, at).r, 1);
  at.color[3] = 0.2f;
  EXPECT_EQ(table.evaluate(3, at).r, 0);
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
