#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>

#include "common/base/error.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"
#include "common/image/image.h"
#include "tests/common/image/temp_folder.h"

// OpenImageIO leaves a PNG file that is cut short by longjmp, past a string of its own (PngReadCallback).
extern "C" const char* __lsan_default_suppressions() { return "leak:OpenImageIO_v*::ImageInput::geterror"; }
// Stacks that reach it: libraries keep no frame pointers.
extern "C" const char* __asan_default_options() { return "fast_unwind_on_malloc=0"; }

namespace lightmill {
namespace {

using testing::TempFolder;

Image random_image(int width, int height, float scale = 1) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<float> value(0, scale);
  Image image(width, height);
  for (float& v : image.data) v = value(rng);
  return image;
}

size_t files_in(const TempFolder& folder) {
  size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++count;
  return count;
}

std::string message_of(const std::function<void()>& f, ErrorKind kind) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), kind);
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

TEST(ImageFile, ExrAndPfmKeepEveryBit) {
  const TempFolder folder;
  Image image = random_image(37, 21, 1000);
  image.data[0] = 1e-30f;
  image.data[1] = 1e30f;
  image.data[2] = std::numeric_limits<float>::denorm_min();
  for (const char* name : {"a.exr", "a.pfm", "a.EXR"}) {
    write_image(image, folder / name);
    const Image back = read_image(folder / name);
    EXPECT_EQ(back.width, 37);
    EXPECT_EQ(back.height, 21);
    EXPECT_EQ(back.data, image.data) << name;
  }
  EXPECT_EQ(files_in(folder), 3u);  // no temporary file is left
}

TEST(ImageFile, LayersStandBesideTheColours) {
  const TempFolder folder;
  const Image image = random_image(5, 3);
  ChannelImage layers{Image(5, 3, 3), {"albedo.R", "depth.Z", "A"}};
  for (size_t i = 0; i < layers.image.data.size(); ++i)
    layers.image.data[i] = 2049.0f + static_cast<float>(i);
  for (const bool half : {false, true}) {
    write_image(image, folder / "a.exr", {half, {{"spp", "4"}}, &layers, {}});
    const auto in = OIIO::ImageInput::open(folder / "a.exr");
    ASSERT_TRUE(in);
    const OIIO::ImageSpec& spec = in->spec();
    EXPECT_THAT(spec.channelnames, ::testing::ElementsAre("R", "G", "B", "A", "albedo.R", "depth.Z"));
    EXPECT_EQ(spec.channelformat(5), OIIO::TypeDesc::FLOAT);
    EXPECT_EQ(spec.channelformat(4), half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
    EXPECT_EQ(read_image_metadata(folder / "a.exr", "spp"), "4");
    std::vector<float> all(5 * 3 * 6);
    ASSERT_TRUE(in->read_image(0, 0, 0, 6, OIIO::TypeDesc::FLOAT, all.data()));
    EXPECT_EQ(all[6 * 7 + 5], layers.image.data[3 * 7 + 1]) << "2071 is no half float";
    EXPECT_NEAR(all[6 * 7 + 4], layers.image.data[3 * 7], half ? 1 : 0);
    if (half) continue;
    EXPECT_EQ(read_image(folder / "a.exr").data, image.data);
  }
}

TEST(ImageFile, MattesKeepTheirBitsAndWhatTheyAre) {
  const TempFolder folder;
  const Image image = random_image(3, 2);
  ChannelImage layers{Image(3, 2, 2), {"CryptoObject00.r", "CryptoObject00.g"}};
  for (size_t i = 0; i < layers.image.data.size(); ++i)
    layers.image.data[i] = i % 2 ? 0.25f : cryptomatte_id("object " + std::to_string(i));
  const std::string prefix = cryptomatte_prefix("CryptoObject"), manifest(100'000, 'x');
  layers.attributes = {{prefix + "name", "CryptoObject"}, {prefix + "manifest", manifest}};
  for (const bool half : {false, true}) {
    write_image(image, folder / "a.exr", {half, {}, &layers, {}});
    const ChannelImage file = read_channels(folder / "a.exr", 100);
    EXPECT_EQ(file.attributes, layers.attributes);
    for (size_t c = 0; c < 2; ++c) {
      const auto at = std::find(file.channels.begin(), file.channels.end(), layers.channels[c]);
      ASSERT_NE(at, file.channels.end());
      for (size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(file.image.data[i * 5 + static_cast<size_t>(at - file.channels.begin())],
                  layers.image.data[2 * i + c]);
      }
    }
  }
}

TEST(ImageFile, ViewsAreThePublishedCurves) {
  const auto linear = [](float x, ViewCurve curve, double exposure = 0) {
    return srgb_to_linear(view_value(x, {curve, exposure}));
  };
  EXPECT_EQ(view_value(0.3f, {}), linear_to_srgb(0.3f));
  EXPECT_EQ(view_value(0.3f, {ViewCurve::kSrgb, 1}), linear_to_srgb(0.6f));
  EXPECT_EQ(view_value(0.3f, {ViewCurve::kNone, 0}), 0.3f);
  // Hable's white point, and his curve at 1 and 11.2 worked out from his six constants.
  EXPECT_NEAR(linear(5.6f, ViewCurve::kFilmic), 1, 1e-5);
  EXPECT_NEAR(linear(0.5f, ViewCurve::kFilmic), 0.220657 / 0.725129, 1e-5);
  // Narkowicz: 1 after his 0.6 is 2.54 / 3.16 = 0.8038.
  EXPECT_NEAR(linear(1 / 0.6f, ViewCurve::kAces), 2.54 / 3.16, 1e-5);
  for (const ViewCurve curve : {ViewCurve::kSrgb, ViewCurve::kFilmic, ViewCurve::kAces, ViewCurve::kNone}) {
    float last = 0;
    for (float x = 1e-6f; x < 1e30f; x *= 1.5f) {
      const float y = view_value(x, {curve, 0});
      EXPECT_GE(y, last);
      EXPECT_LE(y, 1);
      last = y;
    }
    EXPECT_EQ(view_value(0, {curve, 3}), 0);
    EXPECT_EQ(view_value(std::numeric_limits<float>::quiet_NaN(), {curve, 3}), 0);
    EXPECT_GT(view_value(std::numeric_limits<float>::infinity(), {curve, 3}), 0.99f);
  }
}

TEST(ImageFile, ReducedAveragesWholeBlocks) {
  Image image(5, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i / 3);
  EXPECT_EQ(reduced(image, 5).data, image.data);
  const Image small = reduced(image, 3);
  ASSERT_EQ(small.width, 3);
  ASSERT_EQ(small.height, 2);
  EXPECT_EQ(small.pixel(0, 0)[0], (0 + 1 + 5 + 6) / 4.0f);
  EXPECT_EQ(small.pixel(2, 1)[2], 14);
}

TEST(ImageFile, HalfExrAndHdrKeepTheirPrecision) {
  const TempFolder folder;
  const Image image = random_image(64, 32, 10);
  write_image(image, folder / "half.exr", {.half = true, .metadata = {}});
  const Image half = read_image(folder / "half.exr");
  for (size_t i = 0; i < image.data.size(); ++i)
    EXPECT_NEAR(half.data[i], image.data[i], 1e-3 * image.data[i] + 1e-6);
  write_image(image, folder / "a.hdr");
  const Image hdr = read_image(folder / "a.hdr");
  for (size_t i = 0; i < image.data.size(); ++i) {
    const float* pixel = &image.data[i - i % 3];
    EXPECT_NEAR(hdr.data[i], image.data[i], std::max({pixel[0], pixel[1], pixel[2]}) / 100);
  }
}

TEST(ImageFile, PngIsClampedSrgb) {
  const TempFolder folder;
  Image image(4, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  image.data = {0, 0.5f, 1, -1, 7, nan, 0.0031308f, 0.2140411f, 0.001f, 1, 0, 0};
  write_image(image, folder / "a.png");
  const Image back = read_image(folder / "a.png");
  const std::vector<float> expected = {0, 0.5f, 1, 0, 1, 0, 0.0031308f, 0.2140411f, 0.001f, 1, 0, 0};
  for (size_t i = 0; i < expected.size(); ++i) {
    // Half a step of 1/255 in sRGB.
    EXPECT_NEAR(linear_to_srgb(back.data[i]), linear_to_srgb(expected[i]), 0.5 / 255 + 1e-5) << i;
  }
  EXPECT_EQ(encode_png(image).substr(1, 3), "PNG");
}

TEST(ImageFile, SrgbCurveIsItsOwnInverseAndKnowsItsConstants) {
  for (int i = 0; i <= 1000; ++i) {
    const float v = static_cast<float>(i) / 1000;
    EXPECT_NEAR(srgb_to_linear(linear_to_srgb(v)), v, 2e-6);
  }
  EXPECT_NEAR(linear_to_srgb(0.2140411f), 0.5, 1e-5);
  EXPECT_EQ(linear_to_srgb(2), 1.0f);
  EXPECT_EQ(linear_to_srgb(-2), 0.0f);
}

TEST(ImageFile, WritingReplacesTheFileAndFollowsALink) {
  const TempFolder folder;
  write_image(random_image(8, 8), folder / "a.pfm");
  std::filesystem::create_symlink(folder / "a.pfm", folder / "link.pfm");
  const Image image = random_image(3, 5);
  write_image(image, folder / "link.pfm");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.pfm"));
  EXPECT_EQ(read_image(folder / "a.pfm").data, image.data);
}

TEST(ImageFile, OutputsThatCanNotBeWrittenAreToldEarly) {
  const TempFolder folder;
  check_writable(folder / "fine.exr");
  EXPECT_EQ(files_in(folder), 0u);
  EXPECT_THAT(message_of([&] { check_writable(folder / "a.bmp"); }, ErrorKind::kUsage),
              ::testing::HasSubstr(".exr, .png"));
  EXPECT_THAT(message_of([&] { check_writable(folder / "a"); }, ErrorKind::kUsage),
              ::testing::HasSubstr("format"));
  EXPECT_THAT(message_of([&] { check_writable(folder / "no/a.exr"); }, ErrorKind::kFailed),
              ::testing::HasSubstr("no folder"));
  std::filesystem::create_directory(folder / "dir.exr");
  EXPECT_THAT(message_of([&] { check_writable(folder / "dir.exr"); }, ErrorKind::kFailed),
              ::testing::HasSubstr("folder"));
  for (const char* name : {"no/a.exr", "no/a.pfm", "no/a.png", "dir.exr"}) {
    EXPECT_THAT(message_of([&] { write_image(random_image(2, 2), folder / name); }, ErrorKind::kFailed),
                ::testing::StartsWith(folder / name));
  }
  EXPECT_EQ(files_in(folder), 1u);
  message_of([&] { write_image(Image(), folder / "empty.exr"); }, ErrorKind::kFailed);
}

TEST(ImageFile, BadInputsAreOneLineErrors) {
  const TempFolder folder;
  EXPECT_THAT(message_of([&] { read_image(folder / "none.exr"); }, ErrorKind::kFailed),
              ::testing::HasSubstr("no such file"));
  message_of([&] { read_image(folder.path().string()); }, ErrorKind::kFailed);
  std::ofstream(folder / "text.exr") << "not an image";
  std::ofstream(folder / "text.png") << "not an image";
  std::ofstream(folder / "empty.hdr");
  for (const char* name : {"text.exr", "text.png", "empty.hdr"}) {
    EXPECT_THAT(message_of([&] { read_image(folder / name); }, ErrorKind::kFailed),
                ::testing::StartsWith(folder / name));
  }
}

TEST(ImageFile, TruncatedFilesAreRefused) {
  const TempFolder folder;
  for (const char* name : {"a.exr", "a.png"}) {
    write_image(random_image(64, 64), folder / name);
    std::filesystem::resize_file(folder / name, std::filesystem::file_size(folder / name) / 2);
    EXPECT_THROW(read_image(folder / name), Error) << name;
  }
}

TEST(ImageFile, ASingleChannelIsReplicated) {
  const TempFolder folder;
  Image gray(2, 1, 1);
  gray.data = {0.25f, 4};
  write_image(gray, folder / "gray.pfm");
  EXPECT_EQ(read_image(folder / "gray.pfm").data, (std::vector<float>{0.25f, 0.25f, 0.25f, 4, 4, 4}));
}

}  // namespace
}  // namespace lightmill
