#include "worker/render/guiding/training/photon_guide_trial.h"

#include <vector>

#include "common/base/parallel.h"
#include "worker/render/plan/recorded_cell.h"

namespace lightmill {
namespace {

constexpr int64_t kTrialPathsPerPixel = 16;
/// The guide has led a path if its density without it would be less than this part of what it is.
constexpr float kLed = 0.5f;

/// A contribution to `pixel`.
struct Seen {
  uint32_t pixel = 0;
  Channels rgb{};
  int half = 0;
  GuideOdds odds = kEvenOdds;  // of all strategies that make its path
};

/// What a cell of the pilot pixels has shown.
struct CellNoise {
  std::vector<PixelNoise> camera;
  std::vector<Seen> splats, guided;
  double led = 0, led_unguided = 0, led_light = 0, led_squares = 0;
};

/// A contribution with camera vertices goes by the odds of its camera path.
GuideOdds odds_of(const StrategyContribution& c, const GuideOdds& of_path) {
  GuideOdds odds;
  const FamilyShares& s = c.shares;
  for (size_t k = 0; k < odds.size(); ++k)
    odds[k] = std::max(s.lens + (s.hit + s.next_event + s.connect) * of_path[k], 1e-6f);
  return odds;
}

class Trial {
 public:
  Trial(const StageContext& context, int64_t paths)
      : context_(context),
        pilot_pixels_(context.grid, std::min(paths, kTrialPathsPerPixel * context.grid.crop.area())),
        values_(context.grid, pilot_pixels_),
        cells_(pilot_pixels_.cells.size()) {
    context_.pixel_subset = pilot_pixels_.pixel_subset;
  }

  GuideTrial run(int threads) {
    parallel_for(pilot_pixels_.cells.size(), threads, [&](size_t i) { preview_cell(i); });
    values_.finish();
    GuideTrial sum;
    double light = 0, squares = 0;
    for (const CellNoise& cell : cells_) {
      double now = weighed_sum(cell.camera, values_);
      for (const Seen& s : cell.splats) now += square(s, true);
      for (auto& half : sum.noise) {
        for (double& k : half) k += 0.5 * now;
      }
      // f^2 / p with another p.
      for (const Seen& s : cell.guided) {
        auto& half = sum.noise[static_cast<size_t>(s.half)];
        const double x = square(s, false);
        for (size_t k = 0; k < half.size(); ++k) half[k] += x * (1 / double{s.odds[k]} - 1);
      }
      sum.led += cell.led;
      sum.led_unguided += cell.led_unguided;
      light += cell.led_light;
      squares += cell.led_squares;
    }
    if (squares > 0) sum.led_effective = light * light / squares;
    return sum;
  }

 private:
  double square(const Seen& s, bool splat) const {
    const PixelValue value = values_.of(s.pixel);
    return splat ? double{context_.filter.splat_noise} * value.square_beside(s.rgb, value.splat_share)
                 : value.square_beside(s.rgb, value.camera_share);
  }

  /// All samples of one cell of the pilot pixels.
  void preview_cell(size_t i) {
    CellNoise& cell = cells_[i];
    const auto take_one = [&](const StrategyRecorder& recorder, size_t k, int block) {
      return take(recorder.contributions[k], recorder.odds[k], block, &cell);
    };
    cell.camera = record_cell(context_, pilot_pixels_, i, true, &values_, take_one);
  }

  /// Returns whether the contribution is of the camera layer.
  static bool take(const StrategyContribution& c, const GuideOdds& of_path, int half, CellNoise* cell) {
    Seen seen{c.pixel, {c.rgb[0], c.rgb[1], c.rgb[2]}, half};
    if (c.t == 1) {
      cell->splats.push_back(seen);
      return false;
    }
    if (of_path == kEvenOdds) return true;
    seen.odds = odds_of(c, of_path);
    cell->guided.push_back(seen);
    if (c.s == 0 && of_path.front() < kLed) {
      cell->led += 1;
      cell->led_unguided += double{of_path.front()};
      const double light = double{seen.rgb[0]} + double{seen.rgb[1]} + double{seen.rgb[2]};
      cell->led_light += light;
      cell->led_squares += light * light;
    }
    return true;
  }

  StageContext context_;
  PilotPixels pilot_pixels_;
  PilotValues values_;
  std::vector<CellNoise> cells_;  // of the pilot pixels
};

}  // namespace

GuideTrial try_guide(const StageContext& context, int64_t paths, int threads) {
  return Trial(context, paths).run(threads);
}

}  // namespace lightmill
