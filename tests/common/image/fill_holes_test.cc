#include "common/image/fill_holes.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace lightmill {
namespace {

TEST(FillHoles, LeavesWhatIsKnown) {
  Image image(13, 7);
  std::vector<uint8_t> known(13 * 7);
  for (size_t i = 0; i < known.size(); ++i) {
    known[i] = i % 5 == 0;
    for (size_t c = 0; c < 3; ++c) image.data[3 * i + c] = known[i] ? static_cast<float>(i + c) : -1000;
  }
  const Image before = image;
  fill_holes(known, &image);
  for (size_t i = 0; i < known.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) {
      const float value = image.data[3 * i + c];
      if (known[i]) {
        EXPECT_EQ(value, before.data[3 * i + c]);
      } else {
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 93);
      }
    }
  }
}

TEST(FillHoles, ARampStaysARamp) {
  // One pixel in 16 is known.
  Image image(64, 64, 1);
  std::vector<uint8_t> known(64 * 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool is_known = x % 4 == (y / 4 * 7) % 4 && y % 4 == (x / 4 * 5) % 4;
      known[static_cast<size_t>(64 * y + x)] = is_known;
      *image.pixel(x, y) = is_known ? static_cast<float>(x) : 1e6f;
    }
  }
  fill_holes(known, &image);
  for (int y = 4; y < 60; ++y) {
    for (int x = 4; x < 60; ++x) EXPECT_NEAR(*image.pixel(x, y), x, 4) << x << " " << y;
  }
}

TEST(FillHoles, NothingKnownOrNothingMissingChangesNothing) {
  Image image(5, 4);
  std::fill(image.data.begin(), image.data.end(), 3.0f);
  const Image before = image;
  fill_holes(std::vector<uint8_t>(20, 0), &image);
  EXPECT_EQ(image.data, before.data);
  fill_holes(std::vector<uint8_t>(20, 1), &image);
  EXPECT_EQ(image.data, before.data);
}

}  // namespace
}  // namespace lightmill
