// Numbers of samples within a pixel's stream.
#include "worker/render/pipeline/camera_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <set>
#include <vector>

namespace lightmill {
namespace {

/// Slots of a cell whose pixels all have paths; half of them at effort level `level`, one at each end of the
/// range.
std::unique_ptr<CameraSlots> slots_of_level(int level) {
  auto slots = std::make_unique<CameraSlots>();
  for (int i = 0; i < kCellPixels; ++i) {
    slots->keys[i] = static_cast<uint32_t>(i) * 0x9e3779b9u;
    slots->inside[i] = 1;
    slots->level[i] = i < kCellPixels / 2 ? level : 0;
  }
  slots->inside_count = kCellPixels;
  slots->level[kCellPixels - 2] = slots->least_level = kLeastLevel;
  slots->level[kCellPixels - 1] = slots->most_level = kMostLevel;
  return slots;
}

/// The numbers that pixel 0 gets in superblock `batch`.
std::vector<uint32_t> numbers(int level, int64_t batch) {
  const auto slots = slots_of_level(level);
  std::vector<uint32_t> taken;
  for (int64_t s = batch * kSuperblockSamples; s < (batch + 1) * kSuperblockSamples; ++s) {
    for (int pass = 0; pass < slots->passes(s); ++pass) {
      slots->begin_pass(batch, s, pass);
      if (slots->taken[0]) taken.push_back(slots->index[0]);
    }
  }
  return taken;
}

TEST(CameraSlots, NoNumberComesTwiceInABatch) {
  for (int level = kLeastLevel; level <= kMostLevel; ++level) {
    for (const int64_t batch : {0, 1, 7}) {
      const std::vector<uint32_t> taken = numbers(level, batch);
      EXPECT_EQ(std::set<uint32_t>(taken.begin(), taken.end()).size(), taken.size())
          << "level " << level << ", batch " << batch;
      EXPECT_GE(taken.size(), size_t{16} >> -kLeastLevel);
    }
  }
}

// The first batch is stratified as a whole, like all others: its blocks follow each other in one stream.
TEST(CameraSlots, UniformBatchesHaveTheFirstSixteenNumbers) {
  for (const int64_t batch : {0, 1, 7}) {
    const std::vector<uint32_t> taken = numbers(0, batch);
    ASSERT_EQ(taken.size(), 16u);
    for (uint32_t i = 0; i < 16; ++i) EXPECT_EQ(taken[i], i);
  }
}

}  // namespace
}  // namespace lightmill
