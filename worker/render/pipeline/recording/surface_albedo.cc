#include "worker/render/pipeline/recording/surface_albedo.h"

#include "worker/render/bsdf/diffuse_share.h"
#include "worker/render/bsdf/tables/half_space.h"
#include "worker/render/pipeline/paths/viewer_side.h"
#include "worker/render/scene/materials/blender_builder.h"
#include "worker/render/scene/media/subsurface_body.h"

namespace lightmill {
namespace {

/// Albedo is the mean over this many directions per first hit: as many as pbrt-v4 takes.
constexpr int kAlbedoSamples = 16;

/// Whether what a sample sends beyond the surface is spread all round: there, or in a body.
LaneMask spreads_beyond(LaneInt kind, LaneMask delta) {
  const LaneMask lobes = mask_or(LaneMask(kind == kDiffuseTransmission), LaneMask(kind == kTranslucent));
  return mask_or(enters_bodies<Lane>(kind), mask_and(lobes, mask_not(delta)));
}

/// The diffuse part of a sample's `weight`, of which only its own lobe is known: the share that diffuse lobes
/// have of the BSDF's value between the same directions.
Vec3<Lane> diffuse_weight(const VertexLanes<Lane>& v, LaneMask active, const Vec3<Lane>& wo,
                          const BsdfSample<Lane>& s, const Vec3<Lane>& weight) {
  const LaneMask valid = mask_and(active, s.valid), beyond = LaneMask(s.wi.z * wo.z < 0.0f);
  const LaneMask reflects = mask_and(valid, mask_not(mask_or(beyond, s.delta)));
  Vec3<Lane> share{};
  if (any(reflects)) share = diffuse_share<Lane>(v.kind, reflects, v.params, wo, s.wi);
  const LaneMask spreads = mask_and(mask_and(valid, beyond), spreads_beyond(v.kind, s.delta));
  share = select(spreads, splat3<Lane>(1, 1, 1), share);
  return weight * share;
}

}  // namespace

Vec3<Lane> albedo_at(const RenderScene& scene, const VertexLanes<Lane>& v, LaneMask active,
                     Vec3<Lane>* diffuse) {
  const Frame<Lane> frame(v.ns);
  const Vec3<Lane> wo = viewer_direction(frame.to_local(v.wo), dot(v.ng, v.wo));
  // Light that enters a deep body leaves it this much dimmer.
  const LaneMask bodies =
      scene.any_bodies ? mask_and(active, enters_bodies<Lane>(v.kind)) : splat_mask<Lane>(false);
  Vec3<Lane> of_body{};
  if (any(bodies)) {
    const BodyRecord<Lane> body(scene.bodies.data(),
                                to_int(select(bodies, v.params.p[kBodyNumberSlot], Lane{})));
    const Lane leaves = body.scalar(kBodyLeaves), g = body.scalar(kBodyG);
    const auto channel = [&](Lane albedo) { return body_reflectance(albedo, leaves, g); };
    of_body = {channel(v.params.p[0]), channel(v.params.p[1]), channel(v.params.p[2])};
  }
  Vec3<Lane> sum{}, of_diffuse{};
  for (int i = 0; i < kAlbedoSamples; ++i) {
    const float a = (static_cast<float>(i) + 0.5f) / kAlbedoSamples;
    const auto reversed =
        static_cast<float>(((i & 1) << 3) | ((i & 2) << 1) | ((i & 4) >> 1) | ((i & 8) >> 3));
    const float b = (reversed + 0.5f) / kAlbedoSamples;
    const float golden = static_cast<float>(i) * 0.618034f + 0.25f;
    const float lobe = golden - static_cast<float>(static_cast<int>(golden));
    // Importance: without the 1/eta^2 that scales radiance where it enters a medium.
    const BsdfSample<Lane> s = sample_bsdf<Lane>(v.kind, active, v.params, wo, splat<Lane>(lobe),
                                                 splat<Lane>(a), splat<Lane>(b), Mode::kImportance);
    Vec3<Lane> weight = s.weight;
    if (any(bodies)) weight = select(mask_and(bodies, LaneMask(s.wi.z * wo.z < 0.0f)), of_body, weight);
    sum = sum + select(s.valid, weight, Vec3<Lane>{});
    if (diffuse) of_diffuse = of_diffuse + diffuse_weight(v, active, wo, s, weight);
  }
  const Lane mean = splat<Lane>(1.0f / kAlbedoSamples);
  if (diffuse) *diffuse = of_diffuse * mean;
  return sum * mean;
}

}  // namespace lightmill
