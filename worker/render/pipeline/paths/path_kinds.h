#pragma once
// The kinds of camera paths' rays (common/scene/visibility/ray_kinds.h), in scenes that hide something or
// whose textures ask for them.
//
// Only shapes and lights that are hidden from the camera, or from all but the camera, go together with light
// paths: there what a segment sees depends on its place in the path alone. With other kinds the scene is left
// to camera paths (possible_strategies.h).
#include <bit>

#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/work_items.h"
#include "worker/render/scene/materials/lobe_classes.h"

namespace lightmill {

/// The kinds that Accel gets.
inline KindsOfRays kinds_of_camera_rays(const RenderScene& scene, const Paths& paths) {
  return {scene.hides != 0 ? paths.kinds : nullptr};
}

/// Marks the lanes in `mask` of light vertices on surfaces that the camera does not see: light tracing does
/// not join them to it.
inline void mark_unseen(const RenderScene& scene, const PathLanes<Lane>& path, LaneMask mask,
                        VertexLanes<Lane>* v) {
  if ((scene.hides & kCameraRays) == 0) return;
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const int32_t prim = lane(path.prim, l);
    if (prim >= 0 && scene.is_unseen(prim, lane(path.instance, l))) set_lane(&v->unseen, l, Vertex::kUnseen);
  }
}

/// What is reflected is glossy if the material has no diffuse lobe; one with both kinds of lobes counts as
/// diffuse, but for a Principled BSDF (lobe_classes.h).
constexpr bool reflects_glossily(BsdfKind kind) {
  return is_pure_delta(kind) || kind == kRoughConductor || kind == kRoughDielectric ||
         kind == kAnisotropicConductor || kind == kAnisotropicDielectric || kind == kCoatedConductor ||
         kind == kRoughCoatedConductor || kind == kRoughTintedDielectric || kind == kRoughTintedSheet ||
         kind == kMeasured || kind == kHair || kind == kScatteringCoatedConductor ||
         kind == kRoughScatteringCoatedConductor || kind == kAnisotropicCoatedConductor ||
         kind == kAnisotropicRoughCoatedConductor || kind == kGlossy || kind == kAnisotropicGlossy ||
         kind == kRoughGlass;
}

/// Kinds of a ray that leaves lane `l` of `v` in direction `wi`, not straight on.
inline RayKinds kinds_of_scattering(const VertexLanes<Lane>& v, const Vec3<Lane>& wi, int l) {
  const BsdfKind kind = lane(v.kind, l);
  if (kind == kPhaseFunction) return kVolumeRays | kDiffuseRays;  // as Cycles
  if (lane(dot(v.ng, wi), l) * lane(dot(v.ng, v.wo), l) < 0) return kTransmissionRays;
  const bool glossy =
      has_both_classes<float>(kind)
          ? is_glossy_alone(lane(v.params.p[0], l), lane(v.params.p[1], l), lane(v.params.p[2], l))
          : reflects_glossily(kind);
  return glossy ? kGlossyRays : kDiffuseRays;
}

/// The lanes in `mask` whose light is seen by rays of kinds_of(lane).
template <class Fn>
LaneMask seen_lights(const LightTable& lights, LaneInt light, LaneMask mask, Fn&& kinds_of) {
  if (lights.hidden.empty()) return mask;
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    if (lights.hides(lane(light, l), kinds_of(l))) set_lane(&mask, l, 0);
  }
  return mask;
}

/// Sets the kinds of the rays that leave `v` in directions `wi`.
inline void set_ray_kinds(const VertexLanes<Lane>& v, const Vec3<Lane>& wi, LaneMask delta, LaneMask go,
                          Paths& paths) {
  constexpr float kStraight = 0x1p-30f;  // of squared chords: a little more than directions are rounded by
  const Vec3<Lane> bend = wi + v.wo;
  const LaneMask straight = mask_and(delta, LaneMask(dot(bend, bend) < kStraight));
  for (unsigned bits = mask_bits(mask_and(go, mask_not(straight))); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const bool sharp = (mask_bits(delta) >> l & 1) != 0;
    paths.kinds[lane(v.path, l)] =
        static_cast<RayKinds>(kinds_of_scattering(v, wi, l) | (sharp ? kSharpRays : 0));
  }
}

}  // namespace lightmill
