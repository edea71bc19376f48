#include "common/job/pixel_interleave.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace lightmill {
namespace {

FilmGrid whole_film(int width, int height) { return {width, height, {0, 0, width, height}}; }

const FilmGrid kGrids[] = {whole_film(1, 1),
                           whole_film(31, 3),
                           whole_film(64, 64),
                           whole_film(300, 260),
                           whole_film(1280, 720),
                           {4096, 4096, {1000, 37, 1530, 39}},
                           {640, 480, {33, 31, 97, 65}}};

TEST(PixelInterleave, IsAPermutationOfTheCropWindow) {
  for (const FilmGrid& grid : kGrids) {
    const PixelInterleave interleave(grid);
    const PixelRect& crop = grid.crop;
    std::set<std::pair<int, int>> seen;
    for (int y = crop.y0; y < crop.y1; ++y) {
      for (int x = crop.x0; x < crop.x1; ++x) {
        const FilmPixel p = interleave.to_film(x, y);
        ASSERT_TRUE(p.x >= crop.x0 && p.x < crop.x1 && p.y >= crop.y0 && p.y < crop.y1);
        ASSERT_EQ(interleave.to_packet(p.x, p.y), (FilmPixel{x, y}));
        seen.emplace(p.x, p.y);
      }
    }
    EXPECT_EQ(static_cast<int64_t>(seen.size()), crop.area());
  }
}

/// Most pixels of one packet in any box of `side` x `side` pixels that is `step` pixels from the next.
int most_of_a_packet(const FilmGrid& grid, int side, int step) {
  const PixelInterleave interleave(grid);
  int most = 0;
  for (int y0 = grid.crop.y0; y0 + side <= grid.crop.y1; y0 += step) {
    for (int x0 = grid.crop.x0; x0 + side <= grid.crop.x1; x0 += step) {
      std::map<std::pair<int, int>, int> count;
      for (int y = y0; y < y0 + side; ++y) {
        for (int x = x0; x < x0 + side; ++x) {
          const FilmPixel p = interleave.to_packet(x, y);
          most = std::max(most, ++count[{p.x / kCellSize, p.y / kCellSize}]);
        }
      }
    }
  }
  return most;
}

TEST(PixelInterleave, LeavesFewPixelsOfAPacketInABox) {
  // A box of 32x32 pixels has 16 of each of 64 packets, and those that its edges cut off patches.
  EXPECT_LE(most_of_a_packet(whole_film(1280, 720), 32, 29), 25);
  EXPECT_LE(most_of_a_packet(whole_film(1280, 720), 8, 5), 6);  // touches four patches or more
  // No strip at the film's end is left to a few packets.
  EXPECT_LE(most_of_a_packet(whole_film(300, 260), 32, 4), 28);
  // A film of 8x5 cells.
  EXPECT_LE(most_of_a_packet(whole_film(256, 160), 32, 16), 36);
}

TEST(PixelInterleave, SpreadsThePixelsOfAPacketEvenly) {
  const FilmGrid grid = whole_film(1280, 720);
  const PixelInterleave interleave(grid);
  // Of one packet: pixels in each of 32x32 squares of the 256x256 pixels that it shares with others.
  std::map<std::pair<int, int>, int> squares;
  for (int y = 64; y < 96; ++y) {
    for (int x = 288; x < 320; ++x) {
      const FilmPixel p = interleave.to_film(x, y);
      ++squares[{p.x / 32, p.y / 32}];
    }
  }
  for (const auto& [square, pixels] : squares) {
    EXPECT_GE(square.first, 8);
    EXPECT_LT(square.first, 16);
  }
  EXPECT_GE(squares.size(), 64u);
}

TEST(PixelInterleave, JobsOfOlderVersionsHaveTheirPixelsInPlace) {
  FilmGrid grid{640, 480, {33, 31, 97, 65}};
  grid.interleaved = false;
  const PixelInterleave interleave(grid);
  for (int y = 31; y < 65; ++y) {
    for (int x = 33; x < 97; ++x) {
      EXPECT_EQ(interleave.to_film(x, y), (FilmPixel{x, y}));
      EXPECT_EQ(interleave.to_packet(x, y), (FilmPixel{x, y}));
    }
  }
}

TEST(PixelInterleave, FollowsNoGrid) {
  // Offsets within patches are used about equally: 32x32 patches, 64 offsets.
  const PixelInterleave interleave(whole_film(256, 256));
  std::map<std::pair<int, int>, int> offsets;
  for (int y = 0; y < kCellSize; ++y) {
    for (int x = 0; x < kCellSize; ++x) {
      const FilmPixel p = interleave.to_film(x, y);
      ++offsets[{p.x % 8, p.y % 8}];
    }
  }
  EXPECT_EQ(offsets.size(), 64u);
  double chi_square = 0;
  for (const auto& [offset, count] : offsets) chi_square += (count - 16.0) * (count - 16.0) / 16;
  EXPECT_LT(chi_square, 103.4);  // 63 degrees of freedom, 0.1 %
}

}  // namespace
}  // namespace lightmill
