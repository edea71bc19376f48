#include "common/job/packet_grid.h"

#include <gtest/gtest.h>

#include <vector>

#include "common/film/crop_walk.h"

namespace lightmill {
namespace {

TEST(Grid, BlocksTileTheSampleIndicesWithoutGapOrOverlap) {
  const std::vector<int64_t> sizes = {1, 1, 2, 4, 8, 16, 16, 16};
  int64_t sample = 0;
  for (int64_t b = 0; b < 40; ++b) {
    EXPECT_EQ(block_begin(b), sample);
    const int64_t size = b < 8 ? sizes[static_cast<size_t>(b)] : 16;
    EXPECT_EQ(block_end(b) - block_begin(b), size);
    for (int64_t s = block_begin(b); s < block_end(b); ++s) EXPECT_EQ(block_of_sample(s), b);
    sample += size;
  }
}

TEST(Grid, BlockCountCoversTheSamples) {
  EXPECT_EQ(block_count(0), 0);
  EXPECT_EQ(block_count(1), 1);
  EXPECT_EQ(block_count(2), 2);
  EXPECT_EQ(block_count(3), 3);
  EXPECT_EQ(block_count(16), 5);
  EXPECT_EQ(block_count(17), 6);
  EXPECT_EQ(block_count(64), 8);
  for (int64_t spp = 1; spp < 200; ++spp) {
    EXPECT_LT(block_begin(block_count(spp) - 1), spp);
    EXPECT_GE(block_end(block_count(spp) - 1), spp);
  }
}

TEST(Grid, BlocksNeverCrossASuperblock) {
  for (int64_t b = 0; b < 50; ++b) {
    EXPECT_EQ(superblock_of_sample(block_begin(b)), superblock_of_sample(block_end(b) - 1));
  }
}

TEST(Grid, CellsAndPixelsFollowTheCrop) {
  const FilmGrid grid{100, 70, {33, 10, 65, 64}};
  EXPECT_EQ(grid.cells(), (CellRect{1, 0, 3, 2}));
  EXPECT_EQ(grid.pixels({1, 0, 2, 1}), (PixelRect{33, 10, 64, 32}));
  EXPECT_EQ(grid.pixels({2, 1, 3, 2}), (PixelRect{64, 32, 65, 64}));
  EXPECT_EQ(grid.light_paths_per_spp(), 32 * 54);
}

TEST(Grid, CropIndexIsRowMajorAndMinusOneOutside) {
  const FilmGrid grid{100, 70, {33, 10, 65, 64}};
  int64_t expected = 0;
  for (int y = 0; y < 70; ++y) {
    for (int x = 0; x < 100; ++x) {
      const bool inside = x >= 33 && x < 65 && y >= 10 && y < 64;
      EXPECT_EQ(grid.crop_index(static_cast<uint32_t>(y * 100 + x)), inside ? expected++ : -1);
    }
  }
  EXPECT_EQ(grid.crop_index(0xffffffffu), -1);
}

TEST(Grid, WalkFindsTheSameIndicesInAnyOrder) {
  const FilmGrid grid{100, 70, {33, 10, 65, 64}};
  CropWalk walk(grid);
  for (uint32_t pixel = 0; pixel < 7000; ++pixel) ASSERT_EQ(walk(pixel), grid.crop_index(pixel)) << pixel;
  for (uint32_t i = 0; i < 7000; ++i) {
    const uint32_t pixel = i * 4639 % 7000;  // back and forth
    ASSERT_EQ(walk(pixel), grid.crop_index(pixel)) << pixel;
  }
  EXPECT_EQ(walk(0xffffffffu), -1);
  EXPECT_EQ(walk(0x80000000u), -1);
}

int64_t completed(const std::vector<std::pair<int64_t, int64_t>>& ranges, int64_t spp) {
  int64_t sum = 0;
  for (const auto& [begin, end] : ranges) sum += packets_completed({{0, 0, 3, 2}, begin, end}, spp);
  return sum;
}

TEST(Grid, PacketsCompletedAddUpOverAnyPartition) {
  for (const int64_t spp : {1, 5, 16, 17, 40, 64}) {
    const int64_t all = completed({{0, spp}}, spp);
    EXPECT_EQ(all, 6 * block_count(spp));
    for (int64_t cut = 1; cut < spp; ++cut)
      EXPECT_EQ(completed({{0, cut}, {cut, spp}}, spp), all) << spp << " " << cut;
  }
}

TEST(Grid, PacketsCompletedCountOncePerPacketAcrossAnExtension) {
  // A job of 40 spp, extended to 64: the block 32..47 was cut at 40 and is completed by the second tile.
  EXPECT_EQ(completed({{0, 32}, {32, 40}}, 40), 6 * block_count(40));
  EXPECT_EQ(completed({{0, 32}, {32, 40}}, 64), 6 * 6);
  EXPECT_EQ(completed({{0, 32}, {32, 40}, {40, 48}, {48, 64}}, 64), 6 * block_count(64));
}

}  // namespace
}  // namespace lightmill
