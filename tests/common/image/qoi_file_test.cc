// The QOI reader against the examples of its specification, and against an encoder of a few lines.
#include "common/image/qoi_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <vector>

#include "common/image/image_reader.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using testing::TempFolder;

std::string header(uint32_t width, uint32_t height, int channels, int space) {
  std::string out = "qoif";
  for (const uint32_t x : {width, height}) {
    for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(x >> shift);
  }
  return out + static_cast<char>(channels) + static_cast<char>(space);
}
const std::string kEnd = std::string(7, '\0') + '\1';

ImageSource in_memory(const std::string& bytes) {
  ImageSource source{"a.qoi"};
  source.contents = bytes.data();
  source.bytes = bytes.size();
  return source;
}

std::vector<int> pixels_of(const std::string& bytes) {
  std::string why;
  const auto file = QoiFile::open(in_memory(bytes), &why);
  EXPECT_TRUE(file) << why;
  if (!file) return {};
  const ImageHeader& h = file->header();
  std::vector<uint8_t> out(static_cast<size_t>(h.width * h.height * h.channels));
  EXPECT_TRUE(file->read(0, h.channels, out.data(), &why)) << why;
  return {out.begin(), out.end()};
}

TEST(Qoi, EveryOperation) {
  // A colour with alpha; differences of -1, 0 and 1; of green by 4 with red +1 and blue -3 to it; a run of
  // two; the first again by its place (3 * 10 + 5 * 20 + 7 * 30 + 11 * 40) % 64; a colour, whose alpha stays;
  // and the last.
  const std::string body = std::string("\xff\x0a\x14\x1e\x28") + '\x5b' + "\xa4\x95" + '\xc1' +
                           static_cast<char>((30 + 100 + 210 + 440) % 64) + "\xfe\x01\x02\x03";
  EXPECT_EQ(pixels_of(header(7, 1, 4, 0) + body + kEnd),
            (std::vector<int>{10, 20, 30, 40, 9,  20, 31, 40, 14, 24, 32, 40, 14, 24,
                              32, 40, 14, 24, 32, 40, 10, 20, 30, 40, 1,  2,  3,  40}));
}

TEST(Qoi, ValuesWrapRound) {
  // From black: minus one is 255.
  EXPECT_EQ(pixels_of(header(1, 1, 3, 0) + "\x55" + kEnd), (std::vector<int>{255, 255, 255}));
}

TEST(Qoi, RandomPixelsComeBack) {
  std::mt19937 rng(7);
  std::string body;
  std::vector<int> expected;
  for (int i = 0; i < 60 * 40; ++i) {
    body += '\xff';
    for (int c = 0; c < 4; ++c) {
      expected.push_back(static_cast<int>(rng() % 256));
      body += static_cast<char>(expected.back());
    }
  }
  EXPECT_EQ(pixels_of(header(60, 40, 4, 0) + body + kEnd), expected);
}

TEST(Qoi, FilesAreReadLikeMemory) {
  const TempFolder folder;
  const std::string bytes = header(2, 1, 3, 1) + "\xfe\xcc\x66\x33" + "\xc0" + kEnd;
  std::ofstream(folder / "A.QOI", std::ios::binary) << bytes;
  std::string why;
  const auto image = ImageReader::open({folder / "A.QOI"}, &why);
  ASSERT_TRUE(image) << why;
  EXPECT_TRUE(image->header().is_bytes);
  EXPECT_TRUE(image->header().says_linear);
  EXPECT_EQ(image->header().channels, 3);
  std::vector<float> green(2);
  ASSERT_TRUE(image->read(1, 2, green.data(), &why));
  EXPECT_EQ(green, (std::vector<float>{0x66 / 255.0f, 0x66 / 255.0f}));
  EXPECT_FALSE(QoiFile::open({folder / "absent.qoi"}, &why));
}

TEST(Qoi, DamagedFilesAreRefused) {
  const auto refused = [](const std::string& bytes) {
    std::string why;
    const auto file = QoiFile::open(in_memory(bytes), &why);
    if (!file) return why;
    std::vector<float> out(static_cast<size_t>(file->header().width * file->header().height));
    EXPECT_FALSE(file->read(0, 1, out.data(), &why));
    return why;
  };
  EXPECT_THAT(refused("qoi"), HasSubstr("no QOI file"));
  EXPECT_THAT(refused("PNG " + std::string(30, 'x')), HasSubstr("no QOI file"));
  EXPECT_THAT(refused(header(0, 4, 3, 0) + kEnd), HasSubstr("header is damaged"));
  EXPECT_THAT(refused(header(1, 1, 5, 0) + kEnd), HasSubstr("header is damaged"));
  EXPECT_THAT(refused(header(1u << 30, 1u << 30, 4, 0) + kEnd), HasSubstr("can't hold"));
  EXPECT_THAT(refused(header(40, 40, 4, 0) + std::string(40, '\xfe')),
              HasSubstr("it is cut off: it has 10 of"));
  EXPECT_THAT(refused(header(2, 1, 4, 0) + "\x80"), HasSubstr("it is cut off"));
}

}  // namespace
}  // namespace lightmill
