#pragma once
// Manifold walks find the ways by which a given point of a light shines through glass and off mirrors to a
// given point: the directions from the latter whose ray, followed through the events of a chain, ends at the
// former (Hanika, Droske and Fascione 2015, "Manifold next event estimation"; walks on manifolds: Jakob and
// Marschner 2012). Newton's method begins where photons came from. Derivatives are differences of rays side
// by side, so any surface will do. What is found is a function of the two points and the seeds alone: nothing
// is drawn.
#include "worker/render/guiding/manifold_seeds.h"
#include "worker/render/pipeline/walks/specular_chain.h"

namespace lightmill {

/// A point of a light, or the unit direction to a light at infinity.
struct WalkTarget {
  Vec3<Lane> at;
  LaneMask infinite = splat_mask<Lane>(false);
};

struct WalkEnd {
  LaneMask found = splat_mask<Lane>(false);
  Vec3<Lane> w;      // unit direction from where the walk started
  LaneInt events{};  // SpecularEvents that it followed
  /// Change of the solid angle there per change of the area across the last ray at the target; for a target
  /// at infinity, per change of the solid angle around it.
  Lane density{};
  Vec3<Lane> origin, direction;  // of the ray from the last event to the target
  Vec3<Lane> throughput;         // of its radiance to the start
  LaneInt rays{};                // that were traced
};

/// Whether directions to the same light belong to one way, if they have the same events. What is reflected
/// inside a shell around a light comes from where its other light comes from.
inline LaneMask same_direction(const Vec3<Lane>& a, const Vec3<Lane>& b) {
  constexpr float kApart = 1e-4f;
  const Vec3<Lane> d = a - b;
  return LaneMask(dot(d, d) < kApart * kApart);
}

/// The walks that have found the way that leaves in direction `w` and has `events`.
inline LaneMask found_way(const WalkEnd& end, const Vec3<Lane>& w, LaneInt events) {
  return mask_and(end.found, mask_and(LaneMask(end.events == events), same_direction(end.w, w)));
}

/// A walk per active lane, from the direction `first`.
WalkEnd walk_manifold(const StageContext& context, const ChainStart& start, LaneMask active,
                      const Vec3<Lane>& first, const WalkTarget& target, Wavefront& chains,
                      RenderCounters* counters);

/// Calls visit(end) after every walk, from all seeds of the lanes' groups that have at most `most_events`. A
/// way that an earlier walk found is not found again.
template <class Visit>
void for_each_way(const StageContext& context, ChainStart start, LaneMask active,
                  const std::array<const ManifoldGroup*, kLanes>& groups, LaneInt most_events,
                  const WalkTarget& target, Wavefront& chains, RenderCounters* counters, Visit&& visit) {
  const ManifoldSeeds& seeds = context.scene.manifolds;
  std::array<WalkEnd, ManifoldSeeds::kMost> ways;
  for (int n = 0; n < ManifoldSeeds::kMost; ++n) {
    LaneMask goes = splat_mask<Lane>(false);
    Vec3<Lane> first = splat3<Lane>(0, 0, 1);
    for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
      const int l = std::countr_zero(bits);
      const ManifoldGroup* group = groups[static_cast<size_t>(l)];
      if (!group || n >= group->count) continue;
      const ManifoldSeed& seed = seeds.seeds[static_cast<size_t>(group->first + n)];
      if (SpecularEvents::count_of(seed.events) > lane(most_events, l)) continue;
      const Vec3<float> w =
          followed(seed.p, seed.w, seed.turn, {lane(start.p.x, l), lane(start.p.y, l), lane(start.p.z, l)});
      set_lane(&first, l, w);
      set_lane(&start.events, l, seed.events);
      set_lane(&goes, l, -1);
    }
    WalkEnd& end = ways[static_cast<size_t>(n)];
    end = any(goes) ? walk_manifold(context, start, goes, first, target, chains, counters) : WalkEnd();
    for (int m = 0; m < n; ++m)
      end.found = mask_and(end.found, mask_not(found_way(ways[static_cast<size_t>(m)], end.w, end.events)));
    if (any(goes)) visit(end);
  }
}

}  // namespace lightmill
