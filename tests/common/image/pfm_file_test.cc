// Our reader of PFM gives what OpenImageIO gives, and refuses what is damaged.
#include "common/image/pfm_file.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <random>

#include "common/base/error.h"
#include "common/image/image_reader.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

/// Any bits: denormals, infinities and not-a-numbers, too.
std::string random_floats(size_t count) {
  std::mt19937 rng(5);
  std::string bytes;
  for (size_t i = 0; i < count; ++i) {
    const auto bits = static_cast<uint32_t>(rng());
    bytes.append(reinterpret_cast<const char*>(&bits), sizeof bits);
  }
  return bytes;
}

std::string written(const TempFolder& folder, const std::string& bytes) {
  std::ofstream(folder / "a.pfm", std::ios::binary) << bytes;
  return folder / "a.pfm";
}

/// Channels [begin, end) by OpenImageIO.
std::vector<float> by_library(const std::string& path, int begin, int end, ImageHeader* header) {
  const auto in = OIIO::ImageInput::open(path);
  if (!in) return {};
  const OIIO::ImageSpec& spec = in->spec();
  *header = {spec.width, spec.height, 1, spec.nchannels, false, true, true};
  std::vector<float> all(static_cast<size_t>(spec.width * spec.height * (end - begin)));
  EXPECT_TRUE(in->read_image(0, 0, begin, end, OIIO::TypeDesc::FLOAT, all.data()));
  return all;
}

std::vector<uint32_t> bits(const std::vector<float>& values) {
  std::vector<uint32_t> out;
  for (const float x : values) out.push_back(std::bit_cast<uint32_t>(x));
  return out;
}

/// By our reader, from the file and from memory.
void expect_same(const std::string& path, const std::string& bytes, int begin, int end) {
  ImageHeader header;
  const std::vector<float> expected = by_library(path, begin, end, &header);
  ASSERT_FALSE(expected.empty());
  for (const bool in_memory : {false, true}) {
    ImageSource source{in_memory ? "elsewhere/b.PFM" : path};
    if (in_memory) {
      source.contents = bytes.data();
      source.bytes = bytes.size();
    }
    std::string why;
    const auto in = ImageReader::open(source, &why);
    ASSERT_TRUE(in) << why;
    EXPECT_EQ(in->header().width, header.width);
    EXPECT_EQ(in->header().height, header.height);
    EXPECT_EQ(in->header().depth, 1);
    EXPECT_EQ(in->header().channels, header.channels);
    EXPECT_TRUE(in->header().is_floating_point);
    EXPECT_FALSE(in->header().is_bytes);
    EXPECT_EQ(in->attribute("lightmill:spp"), "");
    std::vector<float> values(expected.size());
    ASSERT_TRUE(in->read(begin, end, values.data(), &why)) << why;
    EXPECT_EQ(bits(values), bits(expected));
  }
}

TEST(PfmFile, HasTheBitsThatOpenImageIOGives) {
  const TempFolder folder;
  for (const char* scale : {"-1.0", "1.0", "-1", "1", "+1", "-2.5", "0.001", "-1e-3", "3e30", "-.5"}) {
    SCOPED_TRACE(scale);
    const std::string colours = std::string("PF\n7 5\n") + scale + '\n' + random_floats(7 * 5 * 3);
    expect_same(written(folder, colours), colours, 0, 3);
    expect_same(folder / "a.pfm", colours, 1, 2);
    const std::string grey = std::string("Pf\n6 11\n") + scale + '\n' + random_floats(6 * 11);
    expect_same(written(folder, grey), grey, 0, 1);
  }
}

TEST(PfmFile, HeadersMayHaveCommentsAndAnySpace) {
  const TempFolder folder;
  for (const char* header : {"PF 2 3 -1.0 ", "PF\r\n2 3\r\n-1.0\n", "PF\n# by hand\n2 3\n#\n-1.0\n",
                             "PF #colours\n2 #columns\n\t3\n\n-1\t", "PF\n+2 3\n1\n"}) {
    SCOPED_TRACE(header);
    // White space and signs of comments: no byte of a float is taken for the header's.
    std::string bytes = header + std::string(2 * 3 * 3 * sizeof(float), '\n');
    bytes.back() = '#';
    expect_same(written(folder, bytes), bytes, 0, 3);
  }
}

std::string refusal(const std::string& bytes) {
  const TempFolder folder;
  const std::string path = written(folder, bytes);
  std::string message;
  try {
    read_image(path);
  } catch (const Error& e) {
    message = e.what();
  }
  EXPECT_THAT(message, ::testing::StartsWith(path + ": can't read the image: "));
  EXPECT_EQ(message.find('\n'), std::string::npos);
  std::string why;
  EXPECT_FALSE(PfmFile::open({path, bytes.data(), bytes.size()}, &why)) << "from memory";
  return message;
}

TEST(PfmFile, DamagedFilesAreRefusedByALine) {
  for (const char* bytes : {"", "P", "not an image", "P6\n1 1\n255\nabc", " PF\n1 1\n-1\n"})
    EXPECT_THAT(refusal(bytes), HasSubstr("begins with neither PF nor Pf")) << bytes;
  const std::string float_bytes(12, '\0');
  for (const char* header : {"PF", "PF\n", "PF\n1", "PF\n1 1", "PF\n1 1\n", "PF\n1 1\n-", "PF\nx 1\n-1\n",
                             "PF\n1.5 1\n-1\n", "PF\n0 1\n-1\n", "PF\n1 0\n-1\n", "PF\n-1 1\n-1\n",
                             "PF\n1 1\n0\n", "PF\n1 1\nnan\n", "PF\n1 1\n-inf\n", "PF\n1 1\n1e60\n",
                             "PF\n1 1\n-1x", "PF\n1 1\n+-1\n", "PF\n99999999999 1\n-1\n", "PF\n#"})
    EXPECT_THAT(refusal(header + float_bytes), HasSubstr("its header is damaged")) << header;
  EXPECT_THAT(refusal("PF\n1 1\n-1"), HasSubstr("its header is damaged")) << "no space ends it";
  EXPECT_THAT(refusal("PF\n" + std::string(5000, ' ') + "1 1\n-1\n" + float_bytes),
              HasSubstr("its header is damaged"));
}

TEST(PfmFile, WhatFollowsThePixelsIsPassedOver) {
  const TempFolder folder;
  const std::string bytes = "PF\n2 3\n-1\n" + random_floats(2 * 3 * 3);
  expect_same(written(folder, bytes + "more"), bytes, 0, 3);
}

// The line end of some systems has two characters: the floats do not begin by the second.
TEST(PfmFile, HeadersMayEndByCarriageReturnAndLineFeed) {
  const TempFolder folder;
  const std::string floats = random_floats(2 * 3 * 3);
  const Image one = read_image(written(folder, "PF\n2 3\n-1\n" + floats));
  EXPECT_EQ(bits(one.data), bits(read_image(written(folder, "PF\r\n2 3\r\n-1\r\n" + floats)).data));
}

TEST(PfmFile, AShorterFileThanTheHeaderSaysIsRefusedBeforeMemoryIsSpent) {
  const std::string one(12, '\0');
  EXPECT_THAT(refusal("PF\n1 2\n-1\n" + one),
              HasSubstr("after the header it has 12 bytes, not the 1 x 2 x 3 floats that the header says"));
  EXPECT_THAT(refusal("PF\n1 1\n-1\n"), HasSubstr("it has 0 bytes"));
  EXPECT_THAT(refusal("Pf\n2147483647 2147483647\n-1\n" + one),
              HasSubstr("2147483647 x 2147483647 x 1 floats"));
  // 2^30 x 2^30 x 3 floats are 12 << 60 bytes, which is 0 in 64 bits.
  EXPECT_THAT(refusal("PF\n1073741824 1073741824\n-1\n"), HasSubstr("it has 0 bytes"));
}

TEST(PfmFile, MoreThanAnImageMayHaveIsRefused) {
  const TempFolder folder;
  const std::string bytes = "Pf\n65537 1\n-1\n" + std::string(65537 * sizeof(float), '\0');
  try {
    read_image(written(folder, bytes));
    ADD_FAILURE() << "was read";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("its size is out of range"));
  }
}

TEST(PfmFile, WhatCanNotBeOpenedSaysWhy) {
  const TempFolder folder;
  std::string why;
  EXPECT_FALSE(ImageReader::open({folder / "none.pfm"}, &why));
  EXPECT_THAT(why, HasSubstr("No such file"));
  std::filesystem::create_directory(folder / "folder.pfm");
  EXPECT_FALSE(ImageReader::open({folder / "folder.pfm"}, &why));
  EXPECT_THAT(why, HasSubstr("directory"));
}

TEST(PfmFile, CutShortWhileItIsReadIsToldAndHoldsNoBytes) {
  const TempFolder folder;
  std::string why;
  const auto in = ImageReader::open({written(folder, "Pf\n1 2\n-1\n12345678")}, &why);
  ASSERT_TRUE(in) << why;
  std::vector<float> values(2);
  uint8_t bytes[2];
  EXPECT_FALSE(in->read(0, 1, bytes, &why));
  std::filesystem::resize_file(folder / "a.pfm", 14);
  EXPECT_FALSE(in->read(0, 1, values.data(), &why));
  EXPECT_THAT(why, HasSubstr("cut short"));
}

}  // namespace
}  // namespace lightmill
