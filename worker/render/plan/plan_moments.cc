#include "worker/render/plan/plan_moments.h"

#include <algorithm>
#include <stdexcept>

namespace lightmill {
namespace {

constexpr size_t kPlans = kMaxPlans;

/// Per plan, sum_j n_j p_j of the recorded plan over that of the plan, which a contribution is to be
/// multiplied with; 0, and the light counted as lost, where the plan has no strategy for the path.
PerPlan correction(const PlanSet& plans, const FamilyShares& a, const float rgb[3], PerPlan* lost) {
  PerPlan factor;
  const float light = rgb[0] + rgb[1] + rgb[2];
  for (size_t k = 0; k < kPlans; ++k) {
    const float density = a.hit * plans.hit[k] + a.next_event * plans.next_event[k] + a.lens * plans.lens[k] +
                          a.connect * plans.connect[k];
    factor[k] = density > 0 ? 1 / density : 0;
    (*lost)[k] += density > 0 ? 0 : light;
  }
  return factor;
}

/// Second moment of single contributions, over the samples of all strategies: those that stem from the lens
/// make noise of splats, the others of the camera layer.
void add_second_moment(const PlanSet& plans, const FamilyShares& a, const float rgb[3], float scale,
                       const PerPlan& factor, size_t half, float half_scale, BlockMoments* block) {
  for (size_t ch = 0; ch < 3; ++ch) {
    const float square = rgb[ch] * rgb[ch];
    for (size_t k = 0; k < kPlans; ++k) {
      const float second = square * factor[k], lens = second * (a.lens * plans.lens[k] * factor[k]);
      block->splat[ch][k] += lens * scale;
      block->camera[half][ch][k] += (second - lens) * half_scale;
    }
    block->mean[ch] += rgb[ch] * scale;
  }
}

}  // namespace

PlanSet::PlanSet(std::vector<SamplingPlan> candidates) : plans(std::move(candidates)) {
  if (plans.size() > kPlans) throw std::logic_error("too many sampling plans");
  for (size_t k = 0; k < plans.size(); ++k) {
    const SamplingPlan& p = plans[k];
    hit[k] = p.strategies & kEmissionHits ? 1.0f : 0.0f;
    next_event[k] = p.strategies & kNextEvent ? 1.0f : 0.0f;
    lens[k] = p.strategies & kLensConnections ? static_cast<float>(p.light_paths) : 0;
    connect[k] = p.strategies & kVertexConnections ? static_cast<float>(p.connections) : 0;
  }
}

void MomentRecorder::begin_cell() {
  cell_ = {};
  cell_.blocks.resize(static_cast<size_t>((kCellSize / side_) * (kCellSize / side_)));
  pixels_.assign(kCellPixels, {});
  samples_ = 0;
}

void MomentRecorder::add_path(int slot, const StrategyContribution* const* first, size_t count) {
  BlockMoments& block = block_of(slot);
  const auto half = half_of(slot % kCellSize, slot / kCellSize);
  std::array<PerPlan, 3> sum{}, squares{};
  for (size_t i = 0; i < count; ++i) {
    const StrategyContribution& c = *first[i];
    const PerPlan factor = correction(plans_, c.shares, c.rgb, &cell_.lost);
    add_second_moment(plans_, c.shares, c.rgb, 1, factor, half, 1, &block);
    const PerPlan& samples = c.s == 0 ? plans_.hit : c.s == 1 ? plans_.next_event : plans_.connect;
    for (size_t ch = 0; ch < 3; ++ch) {
      for (size_t k = 0; k < kPlans; ++k) {
        const float x = samples[k] * c.rgb[ch] * factor[k];
        sum[ch][k] += x;
        squares[ch][k] += x * x;
      }
    }
  }
  // Products of two contributions of one path: over the plan's own strategies.
  Pixel& pixel = pixels_[static_cast<size_t>(slot)];
  for (size_t ch = 0; ch < 3; ++ch) {
    for (size_t k = 0; k < kPlans; ++k) {
      const float x2 = sum[ch][k] * sum[ch][k];
      block.camera[half][ch][k] += x2 - squares[ch][k];
      pixel.sum[ch][k] += sum[ch][k];
      pixel.squares[ch][k] += x2;
    }
  }
}

void MomentRecorder::add_sample(const std::vector<StrategyContribution>& contributions) {
  std::array<size_t, kCellPixels + 1> begin{};
  for (const StrategyContribution& c : contributions) {
    if (c.t > 1) {
      ++begin[static_cast<size_t>(c.slot) + 1];
    } else {
      cell_.splats.push_back({c.pixel, {c.rgb[0], c.rgb[1], c.rgb[2]}, c.shares});
    }
  }
  for (size_t i = 0; i < kCellPixels; ++i) begin[i + 1] += begin[i];
  by_slot_.resize(begin[kCellPixels]);
  std::array<size_t, kCellPixels + 1> next = begin;
  for (const StrategyContribution& c : contributions) {
    if (c.t > 1) by_slot_[next[static_cast<size_t>(c.slot)]++] = &c;
  }
  for (size_t i = 0; i < kCellPixels; ++i) {
    if (begin[i + 1] > begin[i])
      add_path(static_cast<int>(i), by_slot_.data() + begin[i], begin[i + 1] - begin[i]);
  }
  ++samples_;
}

CellMoments MomentRecorder::end_cell(const std::array<bool, kCellPixels>& inside,
                                     const std::array<bool, kCellPixels>& looked_at) {
  const auto n = static_cast<float>(samples_);
  for (BlockMoments& block : cell_.blocks) {
    for (size_t ch = 0; ch < 3; ++ch) {
      block.mean[ch] /= n;
      for (size_t k = 0; k < kPlans; ++k) {
        block.camera[0][ch][k] /= n;
        block.camera[1][ch][k] /= n;
        block.splat[ch][k] /= n;
      }
    }
  }
  for (size_t i = 0; i < kCellPixels; ++i) {
    const int slot = static_cast<int>(i);
    const size_t half = half_of(slot % kCellSize, slot / kCellSize);
    BlockMoments& block = block_of(slot);
    block.pixels[half] += inside[i];
    if (!looked_at[i]) continue;
    ++block.looked_at[half];
    // The squared mean without bias: products of different samples.
    const Pixel& p = pixels_[i];
    for (size_t ch = 0; ch < 3; ++ch) {
      for (size_t k = 0; k < kPlans; ++k) {
        const float sum = p.sum[ch][k];
        block.camera[half][ch][k] -= (sum * sum - p.squares[ch][k]) / (n * (n - 1));
      }
    }
  }
  return std::move(cell_);
}

BlockMoments& BlockMoments::operator+=(const BlockMoments& o) {
  for (size_t half = 0; half < 2; ++half) {
    pixels[half] += o.pixels[half];
    looked_at[half] += o.looked_at[half];
  }
  for (size_t ch = 0; ch < 3; ++ch) {
    mean[ch] += o.mean[ch];
    for (size_t k = 0; k < kPlans; ++k) {
      camera[0][ch][k] += o.camera[0][ch][k];
      camera[1][ch][k] += o.camera[1][ch][k];
      splat[ch][k] += o.splat[ch][k];
    }
  }
  return *this;
}

void add_splat(const PlanSet& plans, const RecordedSplat& splat, size_t half, float scale,
               BlockMoments* block, PerPlan* lost) {
  const PerPlan factor = correction(plans, splat.shares, splat.rgb, lost);
  // Splats land on all pixels, sums are over those looked at.
  const auto share = [&](int looked_at, int pixels) {
    return pixels > 0 ? scale * static_cast<float>(looked_at) / static_cast<float>(pixels) : 0;
  };
  add_second_moment(plans, splat.shares, splat.rgb,
                    share(block->all_looked_at(), block->pixels[0] + block->pixels[1]), factor, half,
                    share(block->looked_at[half], block->pixels[half]), block);
}

}  // namespace lightmill
