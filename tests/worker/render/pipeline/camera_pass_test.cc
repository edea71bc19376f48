// Numbers of samples within a pixel's stream.
#include "worker/render/pipeline/camera_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <tuple>
#include <vector>

namespace lightmill {
namespace {

/// Slots of a cell whose pixels all have paths; half of them have allocation level `level`, one at each end
/// of the range.
std::unique_ptr<CameraSlots> slots_of_level(int level) {
  auto slots = std::make_unique<CameraSlots>();
  for (int i = 0; i < kCellPixels; ++i) {
    slots->pixel_keys[i] = static_cast<uint32_t>(i) * 0x9e3779b9u;
    slots->inside[i] = 1;
    slots->level[i] = i < kCellPixels / 2 ? level : 0;
  }
  slots->inside_count = kCellPixels;
  slots->level[kCellPixels - 2] = kLeastLevel;
  slots->level[kCellPixels - 1] = kMostLevel;
  slots->uneven = true;
  return slots;
}

/// visit() in every pass of superblock `batch`; those of paths that wait begin as early as they can, or if
/// `by_index` after each sample index.
template <class Visit>
void for_each_pass(CameraSlots* slots, int64_t batch, bool by_index, Visit&& visit) {
  slots->begin_indices(batch);
  for (int64_t s = batch * kSuperblockSamples; s < (batch + 1) * kSuperblockSamples; ++s) {
    if (slots->is_even(s)) {
      slots->begin_even_pass(s);
      visit();
      continue;
    }
    slots->add_waiting(s);
    while (slots->begin_waiting_pass(by_index || s + 1 == (batch + 1) * kSuperblockSamples)) visit();
  }
}

/// The numbers that pixel 0 gets in superblock `batch`.
std::vector<uint32_t> numbers(int level, int64_t batch) {
  const auto slots = slots_of_level(level);
  std::vector<uint32_t> taken;
  for_each_pass(slots.get(), batch, false, [&] {
    for (int i = 0; i < kCellPixels; ++i) {
      if (slots->taken[i] && slots->pixel[i] == 0) taken.push_back(slots->index[i]);
    }
  });
  return taken;
}

// Whatever the level, a pixel takes the numbers of a replicate's stream one after the other, so that its
// samples are the beginning of a low-discrepancy sequence.
TEST(CameraSlots, NumbersOfAReplicateFollowOneAnother) {
  for (int level = kLeastLevel; level <= kMostLevel; ++level) {
    std::set<uint32_t> taken[kReplicates];
    for (int64_t k = 0; k < 32; ++k) {
      for (const uint32_t number : numbers(level, k))
        EXPECT_TRUE(taken[replicate_of(k).replicate].insert(number).second) << "level " << level << ", " << k;
      for (const std::set<uint32_t>& numbers : taken) {
        if (numbers.empty()) continue;
        EXPECT_EQ(*numbers.begin(), 0u) << "level " << level;
        EXPECT_EQ(*numbers.rbegin() + 1, numbers.size()) << "level " << level << ", superblock " << k;
      }
    }
    // Of 16 superblocks: 16 samples each, more or fewer by the level, but for the uniform ones.
    const double share = std::ldexp(1.0, level);
    EXPECT_EQ(static_cast<double>(taken[1].size()), 16 * 16 * share);
    EXPECT_EQ(static_cast<double>(taken[0].size()), (16 * 16 - 4) * share + 4);
  }
}

// Which pass a path is in changes nothing of it, and what waits fills the passes.
TEST(CameraSlots, PathsThatWaitAreTheSameAndFillTheirPasses) {
  using Path = std::tuple<int32_t, uint32_t, uint32_t, float>;
  for (const int level : {kLeastLevel, kMostLevel}) {
    for (const int64_t batch : {0, 3}) {
      std::array<std::vector<Path>, 2> paths;
      std::array<int, 2> passes{}, full{};
      for (size_t by_index = 0; by_index < 2; ++by_index) {
        const auto slots = slots_of_level(level);
        for_each_pass(slots.get(), batch, by_index > 0, [&] {
          const auto count = std::count(std::begin(slots->taken), std::end(slots->taken), 1);
          ++passes[by_index];
          full[by_index] += count == kCellPixels;
          for (int i = 0; i < kCellPixels; ++i) {
            if (!slots->taken[i]) continue;
            const int pixel = slots->pixel[i];
            EXPECT_EQ(slots->keys[i], slots->pixel_keys[pixel]);
            paths[by_index].push_back({pixel, slots->keys[i], slots->index[i], slots->weight[i]});
          }
        });
        std::sort(paths[by_index].begin(), paths[by_index].end());
      }
      EXPECT_EQ(paths[0], paths[1]);
      EXPECT_EQ(full[0], passes[0] - 1) << "all but the last";
      EXPECT_LT(passes[0], passes[1]);
    }
  }
}

}  // namespace
}  // namespace lightmill
