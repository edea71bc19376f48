#include "worker/render/plan/plan_moments.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "worker/render/plan/emitter_edges.h"

namespace lightmill {
namespace {

constexpr size_t kPlans = kMaxPlans;

/// PlanSet::density_ratio; where a plan has no strategy for the path, the light is counted as lost.
PerPlan correction(const PlanSet& plans, const FamilyShares& a, const float rgb[3], PerPlan* lost) {
  const PerPlan factor = plans.density_ratio(a);
  const float light = rgb[0] + rgb[1] + rgb[2];
  for (size_t k = 0; k < kPlans; ++k) (*lost)[k] += factor[k] > 0 ? 0 : light;
  return factor;
}

/// The part of `factor` that roulette judges splats by: before they are divided by the number of light paths.
PerPlan splat_factor(const PlanSet& plans, const PerPlan& factor) {
  PerPlan own;
  for (size_t k = 0; k < kPlans; ++k) own[k] = factor[k] * plans.lens[k];
  return own;
}

/// Probability that roulette keeps a contribution under each plan, over that in the recorded plan.
PerPlan kept_share(float size, const PerPlan& factor) {
  PerPlan kept;
  const float inv_recorded = 1 / connection_survival(size);
  for (size_t k = 0; k < kPlans; ++k) kept[k] = connection_survival(size * factor[k]) * inv_recorded;
  return kept;
}

void count_ray(const PerPlan& kept, RayCounts* rays) {
  rays->recorded += 1;
  for (size_t k = 0; k < kPlans; ++k) rays->kept[k] += double{kept[k]};
}

/// Per plan: the part of the second moment in the camera layer that comes from samples of the plan's own
/// strategies. From these the squared mean is subtracted sample by sample, so they alone know of little
/// noise, and of the noise of Russian roulette, which shares of densities leave out. Samples of all
/// strategies know more where the plan's own find next to nothing of the light.
PerPlan own_part(const PlanSet& plans, const FamilyShares& a) {
  constexpr float kEnough = 0.03f;
  PerPlan part;
  for (size_t k = 0; k < kPlans; ++k) {
    const float share =
        a.hit * plans.hit[k] + a.next_event * plans.next_event[k] + (plans.connect[k] > 0 ? a.connect : 0);
    const float known = std::min(share * (1 / kEnough), 1.0f);
    part[k] = known * known;
  }
  return part;
}

/// Adds the second moment of single contributions. The part of light tracing goes to the noise of splats, the
/// rest to the camera layer: there `own_part` of it comes from the plan's own samples, of which this one is
/// `samples`, and the rest from those of all strategies. A value v that roulette keeps with probability q
/// counts as v / q, which is v^2 / q on average. `rare` may be null.
void add_second_moment(const PlanSet& plans, const FamilyShares& a, const PerPlan& samples,
                       const float rgb[3], const PixelValue& value, float share, float scale,
                       const PerPlan& factor, const PerPlan& kept, size_t half, float half_scale,
                       BlockMoments* block, RarePaths* rare) {
  const PerPlan own = own_part(plans, a);
  PerPlan per_square, lens_share, camera_share, splat_share;
  for (size_t k = 0; k < kPlans; ++k) {
    per_square[k] = factor[k] / kept[k];
    lens_share[k] = a.lens * plans.lens[k] * factor[k];
    camera_share[k] = (1 - lens_share[k]) * (1 - own[k]) + own[k] * samples[k] * factor[k];
    splat_share[k] = lens_share[k] * plans.splat_noise[k];
  }
  float squares = 0;
  for (size_t ch = 0; ch < 3; ++ch) {
    const float square = rgb[ch] * rgb[ch] * value.weight_beside(ch, rgb[ch], share);
    squares += square;
    for (size_t k = 0; k < kPlans; ++k) {
      const float second = square * per_square[k];
      block->splat[ch][k] += second * splat_share[k] * scale;
      block->camera[half][ch][k] += second * camera_share[k] * half_scale;
    }
  }
  if (!rare || !rare->takes(squares)) return;
  RarePath path{squares, {}};
  for (size_t k = 0; k < kPlans; ++k)
    path.variance[k] = squares * per_square[k] * (splat_share[k] * scale + (1 - lens_share[k]) * half_scale);
  rare->add(path);
}

/// A visible emitter is noise only in pixels of which it covers a part. How much of the answer comes from
/// samples of the pixel, as against light tracing: samples know what stratification gains, but miss slivers.
struct InSight {
  float covered;  // part of the pixel that emits, at most
  float sampled;  // share of the noise that samples are asked for (end_cell); the rest is add_unsampled's
};
InSight in_sight(const FamilyShares& a, const float rgb[3], const PixelValue& value) {
  constexpr float kWellSampled = 1.0f / 8;  // of the pixel
  const float light = rgb[0] + rgb[1] + rgb[2], all = value.value[0] + value.value[1] + value.value[2];
  const float covered = light > 0 ? std::min(all * a.hit / light, 1.0f) : 1;
  const float by_lens = (1 - a.hit * a.hit) * std::max(1 - covered / kWellSampled, 0.0f);
  return {covered, 1 - by_lens};
}

/// What hits of a visible emitter add to the noise of the camera layer without the share that samples tell:
/// from hits and light tracing alike.
void add_unsampled(const PlanSet& plans, const FamilyShares& a, const float rgb[3], const PixelValue& value,
                   const PerPlan& factor, size_t half, float scale, BlockMoments* block) {
  const InSight seen = in_sight(a, rgb, value);
  const float part = a.hit * (1 - seen.sampled) * (1 - seen.covered) *
                     stratified_edge(seen.covered, plans.lengths.render) * scale;
  for (size_t ch = 0; ch < 3; ++ch) {
    const float noise = value.weight(ch) * rgb[ch] * rgb[ch] * part;
    for (size_t k = 0; k < kPlans; ++k)
      block->camera[half][ch][k] += plans.hit[k] * noise * factor[k] * factor[k];
  }
}

}  // namespace

MomentRecorder::MomentRecorder(const PlanSet& plans, int side)
    : plans_(plans), side_(side), pixels_(kCellPixels) {}

void MomentRecorder::begin_cell(const std::array<PixelValue, kCellPixels>& values) {
  values_ = values;
  cell_ = {};
  cell_.blocks.resize(static_cast<size_t>((kCellSize / side_) * (kCellSize / side_)));
  samples_ = 0;
}

/// Products of two connections of a camera vertex to light vertices of one depth. Systematic sampling draws
/// fewer pairs than independent draws would: the fewer draws, the fewer pairs.
void MomentRecorder::add_pairs(const std::array<PerPlan, 3>& sum, const std::array<PerPlan, 3>& squares,
                               int slot) {
  const PixelValue& value = values_[static_cast<size_t>(slot)];
  BlockMoments& block = block_of(slot);
  const auto half = half_of(slot % kCellSize, slot / kCellSize);
  for (size_t ch = 0; ch < 3; ++ch) {
    for (size_t k = 0; k < kPlans; ++k)
      block.camera[half][ch][k] +=
          value.weight(ch) * plans_.more_pairs[k] * (sum[ch][k] * sum[ch][k] - squares[ch][k]);
  }
}

void MomentRecorder::add_path(int slot, int sample_block, const StrategyContribution* const* first,
                              size_t count, float survival) {
  const PixelValue& value = values_[static_cast<size_t>(slot)];
  Pixel& pixel = pixels_[static_cast<size_t>(slot)];
  BlockMoments& block = block_of(slot);
  const auto half = half_of(slot % kCellSize, slot / kCellSize);
  std::array<PerPlan, 3> sum{}, squares{}, kind_sum{}, kind_squares{}, after{};
  int t = 0, s = 0;  // of kind_sum
  for (size_t i = 0; i < count; ++i) {
    const StrategyContribution& c = *first[i];
    const bool connection = c.s > 1;
    if (connection && (c.t != t || c.s != s)) {
      if (t) add_pairs(kind_sum, kind_squares, slot), kind_sum = kind_squares = {};
      t = c.t, s = c.s;
    }
    const PerPlan factor = correction(plans_, c.shares, c.rgb, &cell_.lost);
    const PerPlan kept = kept_share(c.size, factor);
    if (c.s > 0) count_ray(kept, c.s == 1 ? &cell_.next_event : &cell_.connect);
    const bool emitter_in_sight = c.s == 0 && c.t == 2;
    const PerPlan& samples = c.s == 0 ? plans_.hit : c.s == 1 ? plans_.next_event : plans_.connect;
    float part = 1;
    if (emitter_in_sight) {
      const float gain = noise_at_edges(plans_.lengths.render) / noise_at_edges(plans_.lengths.pilot);
      part = std::sqrt(in_sight(c.shares, c.rgb, value).sampled * gain);
      add_unsampled(plans_, c.shares, c.rgb, value, factor, half, 1, &block);
    } else {
      // An emitter hit is as bright as the emitter, and a rarer path is no brighter: hits have no tail.
      add_second_moment(plans_, c.shares, samples, c.rgb, value, value.camera_share, 1, factor, kept, half, 1,
                        &block, c.s > 0 ? &cell_.rare : nullptr);
    }
    for (size_t ch = 0; ch < 3; ++ch) {
      const float limit = emitter_in_sight ? 0 : value.rare(ch);
      PerPlan& even = pixel.even[sample_block][ch];
      for (size_t k = 0; k < kPlans; ++k) {
        const float x = part * samples[k] * c.rgb[ch] * factor[k];
        sum[ch][k] += x;
        if (!emitter_in_sight) squares[ch][k] += x * x;
        if (connection) kind_sum[ch][k] += x, kind_squares[ch][k] += x * x;
        even[k] += x < limit ? x : 0;
        if (c.t > kLeastRrDepth + 1) after[ch][k] += x;  // the camera is a vertex, too
      }
    }
  }
  if (survival > 0 && survival < 1) {
    // What comes after an event of survival q counts as x / q or 0: its second moment is x^2 / q.
    for (size_t ch = 0; ch < 3; ++ch) {
      const float weight = value.weight(ch) * (1 / survival - 1);
      for (size_t k = 0; k < kPlans; ++k) block.roulette[half][k] += weight * after[ch][k] * after[ch][k];
    }
  }
  if (t) add_pairs(kind_sum, kind_squares, slot);
  // Products of two contributions of one path, by the plan's own strategies.
  for (size_t ch = 0; ch < 3; ++ch) {
    for (size_t k = 0; k < kPlans; ++k) {
      const float x2 = sum[ch][k] * sum[ch][k];
      block.camera[half][ch][k] += value.weight(ch) * (x2 - squares[ch][k]);
      pixel.sums[sample_block][ch][k] += sum[ch][k];
      pixel.squares[ch][k] += x2;
    }
  }
}

void MomentRecorder::add_sample(const std::vector<StrategyContribution>& contributions,
                                std::span<const float> survival, int block) {
  std::array<size_t, kCellPixels + 1> begin{};
  for (const StrategyContribution& c : contributions) {
    if (c.t > 1) {
      ++begin[static_cast<size_t>(c.slot) + 1];
    } else {
      cell_.splats.push_back({c.pixel, {c.rgb[0], c.rgb[1], c.rgb[2]}, c.size, c.s == 1, c.shares});
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
      add_path(static_cast<int>(i), block, by_slot_.data() + begin[i], begin[i + 1] - begin[i], survival[i]);
  }
  ++samples_;
}

CellMoments MomentRecorder::end_cell(const std::array<bool, kCellPixels>& inside,
                                     const std::array<bool, kCellPixels>& looked_at) {
  const auto n = static_cast<float>(samples_);
  cell_.rare.scale(1 / n);
  for (BlockMoments& block : cell_.blocks) {
    for (size_t ch = 0; ch < 3; ++ch) {
      for (size_t k = 0; k < kPlans; ++k) {
        block.camera[0][ch][k] /= n;
        block.camera[1][ch][k] /= n;
        block.splat[ch][k] /= n;
      }
    }
    for (PerPlan& half : block.roulette) {
      for (float& v : half) v /= n;
    }
  }
  for (size_t i = 0; i < kCellPixels; ++i) {
    const int slot = static_cast<int>(i);
    const size_t half = half_of(slot % kCellSize, slot / kCellSize);
    BlockMoments& block = block_of(slot);
    block.pixels[half] += inside[i];
    if (!looked_at[i]) continue;
    ++block.looked_at[half];
    // Products of samples of one block, which are stratified together, less those of samples of different
    // blocks, which are the squared mean without bias. A sum over a block stands for its samples.
    Pixel& p = pixels_[i];
    for (size_t ch = 0; ch < 3; ++ch) {
      for (size_t k = 0; k < kPlans; ++k) {
        const float first = p.sums[0][ch][k], second = p.sums[1][ch][k];
        block.camera[half][ch][k] +=
            values_[i].weight(ch) *
            (first * first + second * second - p.squares[ch][k] - 2 * first * second) / n;
        const float difference = p.even[0][ch][k] - p.even[1][ch][k];
        block.even[half][k] += values_[i].weight(ch) * difference * difference / n;
      }
    }
    p = {};  // 5 MB a cell, of which little is used where few are pilot pixels
  }
  return std::move(cell_);
}

BlockMoments& BlockMoments::operator+=(const BlockMoments& o) {
  for (size_t half = 0; half < 2; ++half) {
    pixels[half] += o.pixels[half];
    looked_at[half] += o.looked_at[half];
  }
  for (size_t ch = 0; ch < 3; ++ch) {
    for (size_t k = 0; k < kPlans; ++k) {
      camera[0][ch][k] += o.camera[0][ch][k];
      camera[1][ch][k] += o.camera[1][ch][k];
      splat[ch][k] += o.splat[ch][k];
    }
  }
  for (size_t half = 0; half < 2; ++half) {
    for (size_t k = 0; k < kPlans; ++k) {
      roulette[half][k] += o.roulette[half][k];
      even[half][k] += o.even[half][k];
    }
  }
  return *this;
}

RayCounts& RayCounts::operator+=(const RayCounts& o) {
  recorded += o.recorded;
  for (size_t k = 0; k < kPlans; ++k) kept[k] += o.kept[k];
  return *this;
}

void add_splat(const PlanSet& plans, const RecordedSplat& splat, const PixelValue& value, size_t half,
               float scale, BlockMoments* block, CellMoments* cell) {
  const PerPlan factor = correction(plans, splat.shares, splat.rgb, &cell->lost);
  const PerPlan kept = kept_share(splat.size, splat_factor(plans, factor));
  count_ray(kept, &cell->lens);
  // Splats land on all pixels; sums are over the pilot pixels.
  const auto share = [&](int looked_at, int pixels) {
    return pixels > 0 ? scale * static_cast<float>(looked_at) / static_cast<float>(pixels) : 0;
  };
  const float pixels = share(block->all_previewed(), block->pixels[0] + block->pixels[1]),
              pixels_of_half = share(block->looked_at[half], block->pixels[half]);
  if (splat.emitter) {
    const float survival = connection_survival(splat.size);  // hits have no such roulette
    const float hit[3] = {splat.rgb[0] * survival, splat.rgb[1] * survival, splat.rgb[2] * survival};
    // Which point of a lamp a path starts at are its first numbers. They are one low-discrepancy point set
    // over all lights, of which each light has those that another number gives it. So this many paths of a
    // sequence, for a unit of light paths, are in the pixel.
    const float one = hit[0] + hit[1] + hit[2],
                paths = one > 0 ? plans.lengths.render * splat.shares.lens *
                                      (value.value[0] + value.value[1] + value.value[2]) / one
                                : 0;
    const auto even = [&](float light_paths) {
      return plans.light_share * (1 - net_noise(paths * light_paths / plans.light_share));
    };
    const PixelValue rest = value.beside_half(splat.rgb, 1 - even(1));
    add_unsampled(plans, splat.shares, hit, rest, factor, half, pixels_of_half / survival, block);
    PerPlan noise;
    for (size_t k = 0; k < kPlans; ++k) {
      const float apart_from_roulette = survival * even(plans.lens[k] / plans.light_tracing_weight[k]);
      noise[k] =
          plans.splat_noise[k] * plans.lens[k] * factor[k] * factor[k] * (1 / kept[k] - apart_from_roulette);
    }
    for (size_t ch = 0; ch < 3; ++ch) {
      const float square = splat.rgb[ch] * splat.rgb[ch] * rest.weight(ch) * pixels;
      for (size_t k = 0; k < kPlans; ++k) block->splat[ch][k] += square * noise[k];
    }
    return;
  }
  add_second_moment(plans, splat.shares, PerPlan{}, splat.rgb, value, value.splat_share, pixels, factor, kept,
                    half, pixels_of_half, block, &cell->rare);
}

}  // namespace lightmill
