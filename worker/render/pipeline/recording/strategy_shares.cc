// The families' parts of dVC along recorded subpaths: the recursion of mis.h once per family.
#include <bit>

#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

void StrategyRecorder::start_light_paths(int base, Lane dvc, LaneInt light, const Vec3<Lane>& direction) {
  for (int l = 0; l < kLanes; ++l) {
    const auto slot = static_cast<size_t>(base + l);
    light_[slot] = {0, lane(dvc, l), 0};
    light_starts[slot] = {lane(light, l), {lane(direction.x, l), lane(direction.y, l), lane(direction.z, l)}};
  }
}

void StrategyRecorder::hit(bool light, LaneInt slot, LaneMask mask, Lane inv_cos) {
  auto& paths = light ? light_ : camera_;
  if (light) light_hits += static_cast<uint64_t>(std::popcount(mask_bits(mask)));
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    Parts& p = paths[static_cast<size_t>(lane(slot, l))];
    if (!light) {
      const auto path = static_cast<size_t>(lane(slot, l));
      ++hits_of_path[path];
      hits_to_save += 1 - static_cast<double>(survival_of_path[path]);
    }
    const float f = lane(inv_cos, l);
    p = {p.next_event * f, p.hit * f, p.lens * f};
  }
}

void StrategyRecorder::roulette(LaneInt slot, LaneMask mask, Lane survival) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    survival_of_path[static_cast<size_t>(lane(slot, l))] = lane(survival, l);
  }
}

void StrategyRecorder::walk_steps(bool light, const std::vector<int32_t>& slots) {
  if (light) {
    light_steps += slots.size();
    return;
  }
  for (const int32_t slot : slots) ++steps_of_path[static_cast<size_t>(slot)];
}

void StrategyRecorder::scatter(bool light, int depth, LaneInt slot, LaneMask mask, Lane gain,
                               Lane dvcm_term) {
  auto& paths = light ? light_ : camera_;
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    Parts& p = paths[static_cast<size_t>(lane(slot, l))];
    const float f = lane(gain, l), own = depth == 1 ? lane(dvcm_term, l) : 0;
    p = {p.next_event * f + (light ? own : 0), p.hit * f, p.lens * f + (light ? 0 : own)};
  }
}

void StrategyRecorder::store(bool light, size_t first, LaneInt slot, LaneMask mask) {
  auto& vertices = light ? light_vertices_ : camera_vertices_;
  vertices.resize(first);
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    vertices.push_back((light ? light_ : camera_)[static_cast<size_t>(lane(slot, std::countr_zero(bits)))]);
  }
}

void StrategyRecorder::add_stored(bool light, LaneInt index, LaneInt depth, Lane scale, Lane dvcm, Lane dvc,
                                  Lane pdf_reverse, FamilyRatios* ratios) const {
  const auto& vertices = light ? light_vertices_ : camera_vertices_;
  for (int l = 0; l < kLanes; ++l) {
    const auto i = static_cast<size_t>(lane(index, l));
    if (i >= vertices.size()) continue;  // a lane past the end
    const Parts& p = vertices[i];
    const float f = lane(scale, l), back = f * lane(pdf_reverse, l), one = f * lane(dvcm, l);
    const bool first = lane(depth, l) == 1;
    FamilyShares& r = (*ratios)[static_cast<size_t>(l)];
    (light ? r.next_event : r.lens) += back * (light ? p.next_event : p.lens) + (first ? one : 0);
    r.hit += back * p.hit;
    r.connect += back * (lane(dvc, l) - p.next_event - p.hit - p.lens) + (first ? 0 : one);
  }
}

void StrategyRecorder::add_camera_path(LaneInt slot, Lane scale, Lane dvc, FamilyRatios* ratios) const {
  for (int l = 0; l < kLanes; ++l) {
    const float part = camera_[static_cast<size_t>(lane(slot, l))].lens, f = lane(scale, l);
    FamilyShares& r = (*ratios)[static_cast<size_t>(l)];
    r.lens += part * f;
    r.connect += (lane(dvc, l) - part) * f;
  }
}

}  // namespace lightmill
