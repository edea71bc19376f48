#include "worker/render/pipeline/camera_pass.h"

#include <algorithm>
#include <cmath>

#include "worker/render/pipeline/context.h"

namespace lightmill {

EffortTable::EffortTable(const FilmGrid& grid, const EffortMap& effort, float film_paths)
    : regions(regions_of(grid)), map(effort) {
  for (int64_t r = 0; r < regions.count(); ++r)
    light_samples.push_back(std::ldexp(film_paths, -map.level(r)));
}

void CameraSlots::begin_batch(const StageContext& context, int cell_x, int cell_y, int64_t batch,
                              const Thinning& thinning) {
  const PixelRect& crop = context.grid.crop;
  const auto width = static_cast<uint64_t>(context.grid.width);
  inside_count = 0;
  least_level = most_level = 0;
  for (int i = 0; i < kCellPixels; ++i) {
    const int x = cell_x * kCellSize + i % kCellSize, y = cell_y * kCellSize + i / kCellSize;
    const uint64_t pixel = static_cast<uint64_t>(y) * width + static_cast<uint64_t>(x);
    keys[i] = stream_key(context.seed, kCameraStream, pixel, static_cast<uint64_t>(batch));
    const bool in_crop = x >= crop.x0 && x < crop.x1 && y >= crop.y0 && y < crop.y1;
    inside[i] = in_crop && thinning.keeps(context.grid.width, x, y) ? 1 : 0;
    inside_count += inside[i];
    level[i] = 0;
    light_samples[i] = context.light_samples;
    if (context.effort && inside[i]) {
      level[i] = context.effort->map.level(context.effort->regions.at(x, y));
      light_samples[i] = context.effort->light_samples_at(x, y);
      least_level = std::min(least_level, level[i]);
      most_level = std::max(most_level, level[i]);
    }
  }
}

void CameraSlots::begin_pass(int64_t batch, int64_t s, int pass) {
  const auto in_batch = static_cast<uint32_t>(s - batch * kSuperblockSamples);
  if (s < kUniformSamples || (least_level == 0 && most_level == 0)) {
    std::fill(std::begin(index), std::end(index), in_batch);
    std::fill(std::begin(weight), std::end(weight), 1.0f);
    std::copy(std::begin(inside), std::end(inside), std::begin(taken));
    return;
  }
  for (int i = 0; i < kCellPixels; ++i) {
    const int more = std::max(level[i], 0), less = std::max(-level[i], 0);
    // Of each group of 2^less indices one is taken, drawn per pixel and group.
    const uint32_t group = in_batch >> less, mask = (1u << less) - 1;
    const bool turn = (in_batch & mask) == (hash_combine(keys[i], group) & mask);
    index[i] = (group << more) + static_cast<uint32_t>(pass);
    // The first batch's uniform samples have the first numbers.
    if (less > 0 && batch == 0) index[i] += static_cast<uint32_t>(kUniformSamples);
    weight[i] = std::ldexp(1.0f, -level[i]);
    taken[i] = inside[i] != 0 && turn && pass < 1 << more ? 1 : 0;
  }
}

}  // namespace lightmill
