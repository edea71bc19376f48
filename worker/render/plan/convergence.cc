#include "worker/render/plan/convergence.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/job/replicates.h"
#include "worker/render/plan/pilot_pixels.h"

namespace lightmill {
namespace {

constexpr size_t kLengths = kMeasuredLengths.size();
/// For squared differences of sums of n samples, which are 2 n^2 times the variance of a mean; all blocks of
/// a pixel are added.
constexpr double kScale = 0.5 / kMeasuredLengths.back();

}  // namespace

double samples_of_replicate(int64_t spp) {
  return static_cast<double>(std::max(std::min(spp, kSuperblockSamples), spp / kReplicates));
}

Convergence& Convergence::operator+=(const Convergence& o) {
  for (size_t i = 0; i < kLengths; ++i) {
    for (size_t k = 0; k < kMaxPlans; ++k) variance[i][k] += o.variance[i][k];
  }
  return *this;
}

PerPlan Convergence::ratio(double samples, double of) const {
  PerPlan ratios;
  for (size_t k = 0; k < kMaxPlans; ++k) {
    /// log2 of the variance with 2^x samples.
    const auto at = [&](double x) {
      const auto place = [&](size_t i) { return std::log2(kMeasuredLengths[i]); };
      size_t i = 0;
      while (i + 2 < kLengths && x > place(i + 1)) ++i;
      const double part = (x - place(i)) / (place(i + 1) - place(i));
      return (1 - part) * std::log2(variance[i][k]) + part * std::log2(variance[i + 1][k]);
    };
    const bool known = std::all_of(variance.begin(), variance.end(), [&](const auto& v) { return v[k] > 0; });
    ratios[k] = known ? static_cast<float>(std::exp2(at(std::log2(samples)) - at(std::log2(of)))) : 1;
  }
  return ratios;
}

ConvergenceRecorder::ConvergenceRecorder(const PlanSet& plans) : plans_(plans) { pixel_of_slot_.fill(-1); }

void ConvergenceRecorder::begin_cell(const std::vector<DeepPixel>& pixels) {
  pixel_of_slot_.fill(-1);
  pixels_.assign(pixels.size(), {});
  cell_ = {};
  samples_ = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    pixel_of_slot_[static_cast<size_t>(pixels[i].slot)] = static_cast<int16_t>(i);
    for (size_t ch = 0; ch < 3; ++ch) {
      pixels_[i].weight[ch] = pixels[i].value.weight(ch);
      pixels_[i].rare[ch] = pixels[i].value.rare(ch);
    }
  }
}

void ConvergenceRecorder::add_sample(const std::vector<StrategyContribution>& contributions, int replicate) {
  const float sign = replicate == 0 ? 1.0f : -1.0f;
  for (const StrategyContribution& c : contributions) {
    if (c.t < 2 || (c.s == 0 && c.t == 2)) continue;  // of what emits in sight only edges are noise
    const int i = pixel_of_slot_[static_cast<size_t>(c.slot)];
    if (i < 0) continue;
    const PerPlan factor = plans_.density_ratio(c.shares);
    const PerPlan& samples = c.s == 0 ? plans_.hit : c.s == 1 ? plans_.next_event : plans_.connect;
    Pixel& pixel = pixels_[static_cast<size_t>(i)];
    for (size_t ch = 0; ch < 3; ++ch) {
      PerPlan& to = pixel.differences[0][ch];
      for (size_t k = 0; k < kMaxPlans; ++k) {
        const float x = c.rgb[ch] * samples[k] * factor[k];
        to[k] += x < pixel.rare[ch] ? sign * x : 0;
      }
    }
  }
  if (replicate == 0) return;
  ++samples_;
  for (size_t i = 0; i < kLengths && samples_ % kMeasuredLengths[i] == 0; ++i) close_block(i);
}

/// A block of this length is complete: its difference counts, and is part of the next longer block's.
void ConvergenceRecorder::close_block(size_t length) {
  for (Pixel& pixel : pixels_) {
    for (size_t ch = 0; ch < 3; ++ch) {
      PerPlan& own = pixel.differences[length][ch];
      const double weight = kScale * double{pixel.weight[ch]};
      for (size_t k = 0; k < kMaxPlans; ++k)
        cell_.variance[length][k] += weight * double{own[k]} * double{own[k]};
      if (length + 1 < kLengths) {
        for (size_t k = 0; k < kMaxPlans; ++k) pixel.differences[length + 1][ch][k] += own[k];
      }
      own = {};
    }
  }
}

const Convergence& ConvergenceRecorder::end_cell() { return cell_; }

Convergence measure_convergence(const Renderer& scene, const RenderSettings& settings, const PlanSet& plans,
                                const PilotValues& values, int64_t pixels, int threads,
                                const std::function<bool()>& go_on) {
  const DeepPixels deep(settings.grid, pixels);
  const Renderer renderer(scene, settings, deep.pixel_subset);
  std::vector<Convergence> cells(deep.cells.size());
  parallel_for(cells.size(), threads, [&](size_t i) {
    if (!go_on()) throw Error(ErrorKind::kFailed, "the pilot was interrupted");
    const CellRect rect = deep.rect(i);
    std::vector<ConvergenceRecorder::DeepPixel> of_cell;
    const PixelRect inside = settings.grid.pixels(rect);
    for (int y = inside.y0; y < inside.y1; ++y) {
      for (int x = inside.x0; x < inside.x1; ++x) {
        const int slot = y % kCellSize * kCellSize + x % kCellSize;
        if (deep.pixel_subset.keeps(x, y)) of_cell.push_back({slot, values.of(x, y)});
      }
    }
    const auto workspace = renderer.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    ConvergenceRecorder convergence(plans);
    convergence.begin_cell(of_cell);
    for (int64_t j = 0; j < kMeasuredLengths.back(); ++j) {
      for (int replicate = 0; replicate < kReplicates; ++replicate) {
        const int64_t s = DeepPixels::index(replicate, j);
        renderer.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder);
        convergence.add_sample(recorder->contributions, replicate);
        recorder->clear();
      }
    }
    cells[i] = convergence.end_cell();
  });
  Convergence sum;
  for (const Convergence& cell : cells) sum += cell;
  return sum;
}

}  // namespace lightmill
