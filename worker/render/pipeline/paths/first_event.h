#pragma once
// Lobes of contributions (common/job/lobes.h): what the first scattering event from the camera was. Nobody
// asks for them but where a tile records lobes.
#include "worker/render/bsdf/diffuse_share.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// Where the wavefront keeps lobes; null at compile time in kernels that nothing observes.
template <class K>
LobedLight* lobes_of(const Wavefront& w) {
  if constexpr (!K::kObserved) return nullptr;
  return w.lobes;
}

/// What the event at `v` is, as the first one of a path that no other follows. `wo`: to the camera, `wi`: to
/// the light, both as the BSDF sees them. The diffuse share is only known for lanes that are active.
inline LobeLanes lobes_of_event(const VertexLanes<Lane>& v, LaneMask active, const Vec3<Lane>& wo,
                                const Vec3<Lane>& wi) {
  const LaneMask in_medium = LaneMask(v.kind == kPhaseFunction), passes = LaneMask(wo.z * wi.z < 0.0f);
  const LaneMask reflects = mask_and(active, mask_not(mask_or(in_medium, passes)));
  LobeLanes lobes;
  lobes.part = select(in_medium, splat_int<Lane>(kVolumeDirect),
                      select(passes, splat_int<Lane>(kTransmissionDirect), splat_int<Lane>(kGlossyDirect)));
  if (any(reflects)) lobes.diffuse = diffuse_share<Lane>(v.kind, reflects, v.params, wo, wi);
  return lobes;
}

/// The same where others follow.
inline LobeLanes made_indirect(LobeLanes lobes) {
  lobes.part = lobes.part + (kDiffuseIndirect - kDiffuseDirect);
  return lobes;
}

/// Keeps the first event of camera paths that go on from `v`. `delta`: by a sharp lobe, which is not diffuse.
inline void keep_first_event(const VertexLanes<Lane>& v, LaneMask go, LaneMask delta, const Vec3<Lane>& wo,
                             const Vec3<Lane>& wi, LobedLight* kept) {
  const LobeLanes lobes = lobes_of_event(v, mask_and(go, mask_not(delta)), wo, wi);
  scatter(kept->event, v.path, lobes.part, go);
  scatter(kept->diffuse[0], v.path, lobes.diffuse.x, go);
  scatter(kept->diffuse[1], v.path, lobes.diffuse.y, go);
  scatter(kept->diffuse[2], v.path, lobes.diffuse.z, go);
}

/// Of what camera paths meet that have had `depth` - 1 events.
inline LobeLanes lobes_of_hit(const LobedLight* kept, LaneInt slot, int depth) {
  LobeLanes lobes;
  if (!kept) return lobes;
  if (depth == 1) {
    lobes.part = splat_int<Lane>(kEmission);
    return lobes;
  }
  lobes.part = gather(kept->event, slot);
  lobes.diffuse = {gather(kept->diffuse[0], slot), gather(kept->diffuse[1], slot),
                   gather(kept->diffuse[2], slot)};
  return depth == 2 ? lobes : made_indirect(lobes);
}

/// Of what is joined to camera vertices at `depth` in direction `wi` (and `wo`: see lobes_of_event).
/// `direct`: a light is, not a path with events of its own.
inline LobeLanes lobes_of_join(const LobedLight* kept, const VertexLanes<Lane>& v, LaneMask active,
                               const Vec3<Lane>& wo, const Vec3<Lane>& wi, int depth, bool direct) {
  if (!kept || depth > 1) return lobes_of_hit(kept, v.path, depth + 1);
  const LobeLanes lobes = lobes_of_event(v, active, wo, wi);
  return direct ? lobes : made_indirect(lobes);
}

}  // namespace lightmill
