// Our writer of EXR stores what OpenImageIO's stores, and tells why it can't.
#include "common/image/exr_file.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <bit>
#include <map>
#include <random>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

const std::vector<std::string> kNames = {"R", "G", "B", "albedo.R", "depth.Z", "A"};
const std::map<std::string, std::string> kAttributes = {
    {"lightmill:spp", "4"}, {"lightmill:none", ""}, {"lightmill:a name of more than 31 bytes", "long"}};

/// Half of them any bits: denormals, infinities and not-a-numbers, too.
std::vector<float> values_of(size_t count) {
  std::mt19937 rng(3);
  std::vector<float> out(count);
  for (float& x : out)
    x = rng() % 2 ? static_cast<float>(rng() % 100000) / 777.0f : std::bit_cast<float>(uint32_t(rng()));
  return out;
}

/// As files of ours were written before.
void write_by_openimageio(const std::string& path, int width, int height, bool half,
                          const std::vector<float>& values) {
  OIIO::ImageSpec spec(width, height, 6, half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
  spec.channelnames = kNames;
  spec.alpha_channel = 5;
  if (half) {
    spec.channelformats.assign(6, OIIO::TypeDesc::HALF);
    spec.channelformats[4] = OIIO::TypeDesc::FLOAT;
  }
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("compression", "zip");
  for (const auto& [name, text] : kAttributes) spec.attribute(name, text);
  const auto out = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(out && out->open(path, spec) && out->write_image(OIIO::TypeDesc::FLOAT, values.data()) &&
              out->close());
}

std::vector<uint32_t> pixel_bits(OIIO::ImageInput& in) {
  const OIIO::ImageSpec& spec = in.spec();
  std::vector<float> values(static_cast<size_t>(spec.width * spec.height * spec.nchannels));
  EXPECT_TRUE(in.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, values.data()));
  std::vector<uint32_t> bits;
  for (const float x : values) bits.push_back(std::bit_cast<uint32_t>(x));
  return bits;
}

/// By name; but the time of writing, and which library wrote.
std::map<std::string, std::string> attributes(const OIIO::ImageSpec& spec) {
  std::map<std::string, std::string> out;
  for (const auto& attribute : spec.extra_attribs) out[attribute.name().string()] = attribute.get_string();
  out.erase("DateTime");
  return out;
}

TEST(ExrFile, HoldsWhatOpenImageIOWouldWrite) {
  const TempFolder folder;
  for (const bool half : {false, true}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {5, 16}, {3, 33}, {61, 47}}) {
      SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height) + (half ? ", half" : ""));
      const std::vector<float> values = values_of(static_cast<size_t>(width * height * 6));
      write_by_openimageio(folder / "theirs.exr", width, height, half, values);
      ExrImage image{width, height, {}, {kAttributes.begin(), kAttributes.end()}};
      for (size_t c = 0; c < 6; ++c) image.channels.push_back({kNames[c], &values[c], 6, half && c != 4});
      std::string why;
      ASSERT_TRUE(write_exr(image, folder / "ours.exr", &why)) << why;
      const auto theirs = OIIO::ImageInput::open(folder / "theirs.exr"),
                 ours = OIIO::ImageInput::open(folder / "ours.exr");
      ASSERT_TRUE(theirs && ours);
      EXPECT_EQ(ours->spec().channelnames, theirs->spec().channelnames);
      EXPECT_EQ(ours->spec().channelformats, theirs->spec().channelformats);
      EXPECT_EQ(ours->spec().format, theirs->spec().format);
      EXPECT_EQ(ours->spec().alpha_channel, theirs->spec().alpha_channel);
      EXPECT_EQ(attributes(ours->spec()), attributes(theirs->spec()));
      EXPECT_THAT(std::string(ours->spec().get_string_attribute("DateTime")),
                  ::testing::MatchesRegex("[0-9]{4}:[0-9]{2}:[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}"));
      EXPECT_EQ(pixel_bits(*ours), pixel_bits(*theirs));
    }
  }
}

TEST(ExrFile, AGreyImageIsALuminance) {
  const TempFolder folder;
  Image grey(3, 2, 1);
  for (size_t i = 0; i < grey.data.size(); ++i) grey.data[i] = static_cast<float>(i);
  write_image(grey, folder / "grey.exr");
  const auto in = OIIO::ImageInput::open(folder / "grey.exr");
  ASSERT_TRUE(in);
  EXPECT_THAT(in->spec().channelnames, ::testing::ElementsAre("Y"));
  const Image back = read_image(folder / "grey.exr");
  for (size_t i = 0; i < back.data.size(); ++i) EXPECT_EQ(back.data[i], grey.data[i / 3]);
}

TEST(ExrFile, LayersOfAnotherSizeAreAMistake) {
  const TempFolder folder;
  const ChannelImage narrow{Image(2, 3, 1), {"A"}}, unnamed{Image(3, 3, 1), {"A", "B"}};
  for (const ChannelImage* layers : {&narrow, &unnamed}) {
    EXPECT_THROW(write_image(Image(3, 3), folder / "a.exr", {false, {}, layers, {}}), std::logic_error);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

/// Files of this process can't grow beyond a size, as on a disk that is full.
class FilesOfAtMost {
 public:
  explicit FilesOfAtMost(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FilesOfAtMost() {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }
  FilesOfAtMost(const FilesOfAtMost&) = delete;
  FilesOfAtMost& operator=(const FilesOfAtMost&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = SIG_DFL;
};

TEST(ExrFile, WhereThereIsNoRoomALineSaysSoAndNothingIsLeft) {
  const TempFolder folder;
  Image image(64, 64);
  image.data = values_of(image.data.size());
  for (const char* name : {"a.exr", "a.pfm"}) {
    write_image(image, folder / name);
    const auto whole = static_cast<rlim_t>(std::filesystem::file_size(folder / name));
    std::filesystem::remove(folder / name);
    // In the header, in the pixels, and at the last byte.
    for (const rlim_t room : {rlim_t{0}, rlim_t{10}, whole / 2, whole - 1}) {
      std::string message;
      try {
        const FilesOfAtMost limit(room);
        write_image(image, folder / name);
      } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kFailed);
        message = e.what();
      }
      EXPECT_EQ(message, folder / name + ": can't write the image: File too large") << room;
      EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    }
  }
}

TEST(ExrFile, WhatOpenExrRefusesSaysSo) {
  const TempFolder folder;
  const float value = 1;
  std::string why;
  EXPECT_FALSE(
      write_exr({1, 1, {{"R", &value, 1, false}, {"R", &value, 1, false}}, {}}, folder / "a.exr", &why));
  EXPECT_THAT(why, HasSubstr("OpenEXR says: "));
  why.clear();
  EXPECT_FALSE(write_exr({1, 1, {{"R", &value, 1, false}}, {}}, folder / "none/a.exr", &why));
  EXPECT_EQ(why, "No such file or directory");
}

}  // namespace
}  // namespace lightmill
