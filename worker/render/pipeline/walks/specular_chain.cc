#include "worker/render/pipeline/walks/specular_chain.h"

#include <bit>

#include "worker/render/bsdf/specular_lobes.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/paths/viewer_side.h"

namespace lightmill {
namespace {

/// Paths of chain `k`. Inactive lanes have the path of an active one, so that it can be read.
Group group_of(int k, LaneMask active) {
  const unsigned bits = mask_bits(active);
  const LaneInt slot =
      select(active, lane_index<Lane>(), splat_int<Lane>(std::countr_zero(bits))) + k * kLanes;
  int32_t slots[kLanes];
  store(slots, slot);
  Group g(slots, kLanes);
  g.active = active;
  return g;
}

/// Takes paths through event `i` of their chains. Returns the lanes where it happened.
LaneMask pass_event(const StageContext& context, const Group& g, LaneMask passes, Wavefront& w,
                    UintOf<Lane>* trace) {
  Hit h = reconstruct<SurfaceKernels>(context.scene, w, g, Mode::kRadiance, 1);
  VertexLanes<Lane>& v = h.v;
  v.params.tables = context.scene.bsdf_tables.data();
  const LaneMask specular = mask_and(h.valid, pure_delta<Lane>(v.kind));
  if (!any(specular)) return specular;
  const Frame<Lane> frame(v.ns);
  Vec3<Lane> wo = frame.to_local(v.wo);
  if (context.scene.any_shading_normals()) wo = viewer_direction(wo, dot(v.ng, v.wo));
  const BsdfSample<Lane> s = specular_lobe<Lane>(v.kind, specular, v.params, wo, passes, Mode::kRadiance);
  const Vec3<Lane> wi = frame.to_world(s.wi), throughput = v.throughput * s.weight;
  LaneMask happens = mask_and(specular, mask_and(s.valid, LaneMask(dot(v.ng, wi) * s.wi.z > 0.0f)));
  happens = mask_and(happens, LaneMask(max_component(throughput) > 0.0f));
  *trace = *trace * 31 + as_uint(h.path.prim) * 7 + as_uint(h.path.instance);
  store_paths<Lane>({offset_origin(v.p, v.error, v.ng, wi), wi, throughput}, g.slot, mask_bits(happens),
                    &w.paths);
  return happens;
}

}  // namespace

std::array<ChainEnd, kChains> follow_chains(const StageContext& context, const ChainStart& start,
                                            LaneMask active,
                                            const std::array<Vec3<Lane>, kChains>& directions, Wavefront& w,
                                            RenderCounters* counters) {
  std::array<ChainEnd, kChains> ends;
  const auto end_of = [&](int k) -> ChainEnd& { return ends[static_cast<size_t>(k)]; };
  Paths& paths = w.paths;
  int most = 0;
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1)
    most = std::max(most, SpecularEvents::count_of(lane(start.events, std::countr_zero(bits))));
  for (int k = 0; k < kChains; ++k) {
    const Vec3<Lane>& direction = directions[static_cast<size_t>(k)];
    end_of(k).reached = active;
    store_paths<Lane>(
        {offset_origin(start.p, start.error, start.ng, direction), direction, splat3<Lane>(1, 1, 1)},
        lane_index<Lane>() + k * kLanes, mask_bits(active), &paths);
    if (context.scene.moves()) store(paths.time + k * kLanes, start.time);
  }
  for (int i = 0; i < most; ++i) {
    const LaneMask has = LaneMask(SpecularEvents::count_of(start.events) > i);
    paths.active_count = 0;
    for (int k = 0; k < kChains; ++k) {
      for (unsigned bits = mask_bits(mask_and(end_of(k).reached, has)); bits; bits &= bits - 1)
        paths.active[paths.active_count++] = k * kLanes + std::countr_zero(bits);
    }
    if (paths.active_count == 0) break;
    context.accel.closest_hits(paths.rays, paths.active, paths.active_count,
                               times_of_rays(context.scene, paths));
    counters->closest_hit_rays += static_cast<uint64_t>(paths.active_count);
    const LaneMask passes = LaneMask(SpecularEvents::passes(start.events, i) > 0);
    for (int k = 0; k < kChains; ++k) {
      ChainEnd& end = end_of(k);
      const LaneMask goes = mask_and(end.reached, has);
      LaneMask hits = goes;
      for (unsigned bits = mask_bits(goes); bits; bits &= bits - 1) {
        const int l = std::countr_zero(bits);
        if (paths.rays[k * kLanes + l].prim < 0) set_lane(&hits, l, 0);
      }
      if (any(hits)) hits = pass_event(context, group_of(k, hits), passes, w, &end.trace);
      end.reached = mask_and(end.reached, mask_or(mask_not(has), hits));
    }
  }
  for (int k = 0; k < kChains; ++k) {
    const PathLanes<Lane> last = load_paths<Lane>(paths, lane_index<Lane>() + k * kLanes);
    end_of(k).origin = last.origin;
    end_of(k).direction = last.direction;
    end_of(k).throughput = last.throughput;
  }
  return ends;
}

}  // namespace lightmill
