#include "worker/render/pipeline/camera_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "worker/render/pipeline/context.h"

namespace lightmill {

namespace {

using Order = std::array<int32_t, kCellPixels>;

/// Pixels of a cell in Morton order: eight that follow one another are a block of 4x2. Interleaved,
/// neighbours are eight pixels apart in the image, so their rays go much the same way, eight rays of a row do
/// not.
constexpr Order morton_order() {
  Order order{};
  for (int32_t i = 0; i < kCellPixels; ++i) {
    int32_t x = 0, y = 0;
    for (int bit = 0; bit < 5; ++bit) {
      x |= (i >> (2 * bit) & 1) << bit;
      y |= (i >> (2 * bit + 1) & 1) << bit;
    }
    order[static_cast<size_t>(i)] = y * kCellSize + x;
  }
  return order;
}
static_assert(kCellSize == 32);
constexpr Order kMortonOrder = morton_order();

}  // namespace

void CameraSlots::begin_superblock(const StageContext& context, int cell_x, int cell_y, int64_t superblock,
                                   const PixelSubset& pixel_subset) {
  const PixelRect& crop = context.grid.crop;
  const auto width = static_cast<uint64_t>(context.grid.width);
  inside_count = 0;
  uneven = false;
  const uint64_t key = begin_indices(superblock);
  if (context.interleave) order_ = kMortonOrder.data();
  for (int i = 0; i < kCellPixels; ++i) {
    FilmPixel p{cell_x * kCellSize + i % kCellSize, cell_y * kCellSize + i / kCellSize};
    const bool in_crop = p.x >= crop.x0 && p.x < crop.x1 && p.y >= crop.y0 && p.y < crop.y1;
    if (in_crop && context.interleave) p = context.interleave->to_film(p.x, p.y);
    x[i] = p.x, y[i] = p.y;
    inside[i] = in_crop && pixel_subset.keeps(p.x, p.y) ? 1 : 0;
    level[i] = 0;
    pixel_keys[i] = 0;
    if (!inside[i]) continue;
    ++inside_count;
    const uint64_t number = static_cast<uint64_t>(p.y) * width + static_cast<uint64_t>(p.x);
    pixel_keys[i] = stream_key(context.seed, kCameraStream, number, key);
    if (context.allocation) {
      level[i] = context.allocation->map.level(context.allocation->regions.at(p.x, p.y));
      uneven |= level[i] != 0;
    }
  }
}

uint64_t CameraSlots::begin_indices(int64_t superblock) {
  // Numbers of a stream have 32 bits, and a pixel may take several for a sample index.
  constexpr int64_t kSuperblocksOfKey = int64_t{1} << 24;
  waiting_.clear();
  order_ = nullptr;
  block_ = replicate_of(superblock);
  first_sample_ = superblock * kSuperblockSamples;
  first_place_ = static_cast<uint32_t>(block_.superblock % kSuperblocksOfKey * kSuperblockSamples);
  return static_cast<uint64_t>(block_.superblock / kSuperblocksOfKey * kReplicates + block_.replicate);
}

void CameraSlots::begin_even_pass(int64_t s) {
  for (int i = 0; i < kCellPixels; ++i) {
    const int32_t p = pixel_at(i);
    pixel[i] = p;
    taken[i] = inside[p];
    keys[i] = pixel_keys[p];
  }
  std::fill(std::begin(index), std::end(index), place(s));
  std::fill(std::begin(weight), std::end(weight), 1.0f);
}

void CameraSlots::add_waiting(int64_t s) {
  const uint32_t at = place(s);
  // The uniform samples, which one of the replicates begins with, took one number each.
  constexpr auto kUniform = static_cast<uint32_t>(kUniformSamples);
  const bool after_uniform = block_.replicate == replicate_of(0).replicate;
  for (int k = 0; k < kCellPixels; ++k) {
    const int32_t i = pixel_at(k);
    if (!inside[i]) continue;
    const int more = std::max(level[i], 0), less = std::max(-level[i], 0);
    // Of each group of 2^less indices one is taken, drawn per pixel and group.
    const uint32_t group = at >> less, mask = (1u << less) - 1;
    if ((at & mask) != (hash_combine(pixel_keys[i], group) & mask)) continue;
    const uint32_t uniform_groups = kUniform >> less << more;
    const uint32_t first = (group << more) + (after_uniform ? kUniform - uniform_groups : 0);
    for (uint32_t n = 0; n < 1u << more; ++n) waiting_.push_back({i, first + n});
  }
}

bool CameraSlots::begin_waiting_pass(bool rest) {
  const size_t count = std::min(waiting_.size(), size_t{kCellPixels});
  if (count == 0 || (!rest && count < kCellPixels)) return false;
  std::fill(std::begin(taken), std::end(taken), 0);
  const std::span<const Waiting> last(waiting_.end() - static_cast<std::ptrdiff_t>(count), waiting_.end());
  for (size_t i = 0; i < count; ++i) {
    const auto k = static_cast<size_t>(last[i].pixel);
    taken[i] = 1;
    pixel[i] = last[i].pixel;
    keys[i] = pixel_keys[k];
    index[i] = last[i].index;
    weight[i] = std::ldexp(1.0f, -level[k]);
  }
  waiting_.resize(waiting_.size() - count);
  return true;
}

}  // namespace lightmill
