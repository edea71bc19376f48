#include "worker/render/plan/first_look.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/image/fill_holes.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/pilot_pixels.h"
#include "worker/render/plan/pilot_values.h"

namespace lightmill {
namespace {

constexpr uint64_t kFirstLookSeed = 0x6c6f6f6b;
/// Camera paths: a tenth of a second or two.
constexpr int64_t kPaths = int64_t{1} << 16;
constexpr int64_t kSamples = 2;

/// The samples of one cell, by slot.
std::vector<Channels> values_of_cell(const Renderer& renderer, const PilotPixels& pixels,
                                     const CellRect& rect, Workspace& workspace, StrategyRecorder& recorder) {
  CellPreview preview;
  for (int64_t j = 0; j < pixels.samples; ++j) {
    const int64_t s = pixels.index(j);
    renderer.record_packet({rect.x0, rect.y0, s, s + 1}, workspace, nullptr, recorder);
    preview.add(recorder.contributions, 0);
    recorder.clear();
  }
  return std::move(preview.pixels);
}

/// Sums of pixels that lie in one of the picture's.
class Reduced {
 public:
  explicit Reduced(const FilmGrid& grid)
      : crop_(grid.crop),
        side_((std::max(crop_.width(), crop_.height()) + kFirstLookSide - 1) / kFirstLookSide),
        image_((crop_.width() + side_ - 1) / side_, (crop_.height() + side_ - 1) / side_),
        count_(image_.data.size() / 3) {}

  void add(int x, int y, const float rgb[3]) {
    const int column = (x - crop_.x0) / side_, row = (y - crop_.y0) / side_;
    float* const to = image_.pixel(column, row);
    for (int c = 0; c < 3; ++c) to[c] += rgb[c];
    ++count_[static_cast<size_t>(row) * static_cast<size_t>(image_.width) + static_cast<size_t>(column)];
  }
  Image finish() {
    std::vector<uint8_t> known(count_.size());
    for (size_t i = 0; i < count_.size(); ++i) {
      known[i] = count_[i] > 0;
      for (size_t c = 0; c < 3; ++c) image_.data[3 * i + c] /= static_cast<float>(std::max(count_[i], 1));
    }
    fill_holes(known, &image_);
    return std::move(image_);
  }

 private:
  const PixelRect crop_;
  const int side_;
  Image image_;
  std::vector<int> count_;
};

}  // namespace

Image first_look(const Renderer& renderer, int threads, const std::function<bool()>& go_on) {
  RenderSettings settings = renderer.settings();
  const Strategies strategies = renderer.plan().possible & (kEmissionHits | kNextEvent);
  if (!strategies) return {};
  settings.plan = SamplingPlan{.strategies = strategies};
  settings.seed ^= kFirstLookSeed;
  const PilotPixels pixels(settings.grid, kPaths, kSamples);
  const Renderer quick(renderer, settings, pixels.pixel_subset);
  std::vector<std::vector<Channels>> cells(pixels.cells.size());
  std::atomic<size_t> next{0};
  std::atomic<bool> stopped{false};
  const auto strands = static_cast<size_t>(thread_count(threads));
  parallel_for(strands, threads, [&](size_t) {
    const auto workspace = quick.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    for (size_t i; !stopped && (i = next++) < cells.size();) {
      if (!go_on()) stopped = true;
      cells[i] = values_of_cell(quick, pixels, pixels.rect(i), *workspace, *recorder);
    }
  });
  if (stopped) throw Error(ErrorKind::kFailed, "the first look was interrupted");

  // A pilot's light is that of the normalised scene.
  const float scale =
      std::ldexp(1.0f, quick.context().scene.light_exponent) / static_cast<float>(pixels.samples);
  Reduced picture(settings.grid);
  for (size_t i = 0; i < cells.size(); ++i) {
    const PixelRect rect = settings.grid.pixels(pixels.rect(i));
    for (int y = rect.y0; y < rect.y1; ++y) {
      for (int x = rect.x0; x < rect.x1; ++x) {
        if (!pixels.pixel_subset.keeps(x, y)) continue;
        const Channels& sum = cells[i][static_cast<size_t>(y % kCellSize * kCellSize + x % kCellSize)];
        float rgb[3] = {sum[0] * scale, sum[1] * scale, sum[2] * scale};
        if (const FilmResponse* response = quick.context().response) response->mix(&rgb[0], &rgb[1], &rgb[2]);
        if (std::isfinite(rgb[0] + rgb[1] + rgb[2])) picture.add(x, y, rgb);
      }
    }
  }
  return picture.finish();
}

}  // namespace lightmill
