#include "worker/render/pipeline/recording/strategy_recorder.h"

#include <algorithm>
#include <bit>

#include "worker/render/pipeline/connections/splat_target.h"
#include "worker/render/pipeline/walks/medium_walk.h"

namespace lightmill {
namespace {

constexpr size_t clipped(int32_t vertices) {
  return static_cast<size_t>(std::min(vertices, kRecordedVertices));
}

FamilyShares shares_of(const FamilyRatios& ratios, Lane weight, int l) {
  const FamilyShares& r = ratios[static_cast<size_t>(l)];
  const float w = lane(weight, l);
  return {r.hit * w, r.next_event * w, r.lens * w, r.connect * w};
}

}  // namespace

uint32_t StrategyRecorder::pixel_of(int32_t slot) const {
  const int32_t pixel = slots_->pixel[slot];
  return static_cast<uint32_t>(slots_->y[pixel]) * static_cast<uint32_t>(width_) +
         static_cast<uint32_t>(slots_->x[pixel]);
}

void StrategyRecorder::announce(LaneInt s, int t, LaneInt slot, LaneInt light_slot, Lane weight,
                                const FamilyRatios& ratios) {
  for (int l = 0; l < kLanes; ++l) {
    announced_[static_cast<size_t>(l)] = {lane(s, l),
                                          t,
                                          lane(slot, l),
                                          lane(light_slot, l),
                                          lane(weight, l),
                                          kNoRoulette,
                                          shares_of(ratios, weight, l)};
  }
}

void StrategyRecorder::candidates(unsigned evaluated, unsigned zero, unsigned rouletted) {
  for (; evaluated; evaluated &= evaluated - 1) {
    const auto l = static_cast<unsigned>(std::countr_zero(evaluated));
    StrategyCounts& c = counts[clipped(announced_[l].s)][clipped(announced_[l].t)];
    ++c.evaluated;
    c.zero += zero >> l & 1;
    c.rouletted += rouletted >> l & 1;
  }
}

void StrategyRecorder::queued(int l, int i, float size) {
  Announced& entry = pending_[static_cast<size_t>(i)];
  entry = announced_[static_cast<size_t>(l)];
  entry.size = size;
}

void StrategyRecorder::resolved(const StageContext& context, const ShadowRays& rays, bool splats,
                                double seconds, const MediaWork* media) {
  for (int i = 0; i < rays.count; ++i) {
    const auto k = static_cast<size_t>(i);
    Announced& a = pending_[k];
    if (media) {
      // All ratios but the strategy's own, which is 1, have P~ as a factor.
      const float passed = media->passed[k], ratio = media->shadow_ratio[k];
      const float reweighted = (1 + ratio) / (1 + ratio * passed), own = a.weight * reweighted;
      FamilyShares& s = a.shares;
      float& family = a.t == 1 ? s.lens : a.s == 1 ? s.next_event : s.connect;
      family -= a.weight;
      for (float* share : {&s.hit, &s.next_event, &s.lens, &s.connect}) *share *= passed * reweighted;
      family = std::max(family, 0.0f) + own;
      a.weight = own;
    }
    StrategyCounts& c = counts[clipped(a.s)][clipped(a.t)];
    c.cpu_seconds += seconds / rays.count;
    ++(rays.occluded[k] ? c.occluded : c.visible);
    if (rays.occluded[k]) continue;
    StrategyContribution made{a.s,
                              a.t,
                              a.slot,
                              a.light_slot,
                              splats ? static_cast<uint32_t>(rays.target[k]) : pixel_of(a.slot),
                              {rays.r[k], rays.g[k], rays.b[k]},
                              a.weight,
                              a.size,
                              a.shares};
    if (splats && !context.filter.is_one_pixel()) {
      const DrawnSplat drawn = draw_splat(context, rays.raster_x[k], rays.raster_y[k], rays.small_choice[k]);
      if (drawn.pixel < 0) continue;
      made.pixel = static_cast<uint32_t>(drawn.pixel);
      for (float& x : made.rgb) x *= drawn.weight;
    }
    contributions.push_back(made);
    if (weigh_guide) odds.push_back(splats ? kEvenOdds : vertex_odds_[static_cast<size_t>(a.slot)]);
  }
  resolving_seconds_ += seconds;
}

void StrategyRecorder::emission(int t, LaneInt slot, LaneMask mask, const Vec3<Lane>& rgb, Lane weight,
                                const FamilyRatios& ratios) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    StrategyCounts& c = counts[0][clipped(t)];
    ++c.evaluated;
    ++c.visible;
    contributions.push_back({0,
                             t,
                             lane(slot, l),
                             -1,
                             pixel_of(lane(slot, l)),
                             {lane(rgb.x, l), lane(rgb.y, l), lane(rgb.z, l)},
                             lane(weight, l),
                             kNoRoulette,
                             shares_of(ratios, weight, l)});
    if (weigh_guide) odds.push_back(odds_[static_cast<size_t>(lane(slot, l))]);
  }
}

void StrategyRecorder::scatter_by_guide(LaneInt slot, LaneMask mask,
                                        const std::array<GuideOdds, kLanes>& of) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    GuideOdds& path = odds_[static_cast<size_t>(lane(slot, l))];
    vertex_odds_[static_cast<size_t>(lane(slot, l))] = path;
    for (size_t k = 0; k < path.size(); ++k) path[k] *= of[static_cast<size_t>(l)][k];
  }
}

void StrategyRecorder::vertex(bool light, int depth, LaneInt slot, LaneMask mask, LaneInt primitive,
                              const Vec3<Lane>& p, const Vec3<Lane>& throughput) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    vertices.push_back({lane(slot, l),
                        light,
                        depth,
                        lane(primitive, l),
                        {lane(p.x, l), lane(p.y, l), lane(p.z, l)},
                        {lane(throughput.x, l), lane(throughput.y, l), lane(throughput.z, l)}});
  }
}

void StrategyRecorder::end_stage(double seconds) {
  seconds = std::max(seconds - resolving_seconds_, 0.0);
  uint64_t total = 0;
  for (size_t s = 0; s < counts.size(); ++s) {
    for (size_t t = 0; t < counts.size(); ++t) total += counts[s][t].evaluated - before_[s][t].evaluated;
  }
  if (total == 0) return;
  for (size_t s = 0; s < counts.size(); ++s) {
    for (size_t t = 0; t < counts.size(); ++t) {
      const uint64_t n = counts[s][t].evaluated - before_[s][t].evaluated;
      counts[s][t].cpu_seconds += seconds * static_cast<double>(n) / static_cast<double>(total);
    }
  }
}

}  // namespace lightmill
