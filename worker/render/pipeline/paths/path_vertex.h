#pragma once
// Stage 3's view of paths: groups of them in lanes, and the vertex that each ends at before anything is
// sampled there.
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/walks/alpha_walk.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/pipeline/walks/subsurface_walk.h"
#include "worker/render/scene/geometry/fibre.h"
#include "worker/render/scene/materials/bump.h"
#include "worker/render/scene/materials/lobe_axes.h"
#include "worker/render/scene/materials/lobe_classes.h"
#include "worker/render/scene/materials/mix.h"

namespace lightmill {

/// A hit in lanes: the path's vertex before anything is sampled there.
struct Hit {
  PathLanes<Lane> path;
  VertexLanes<Lane> v;
  Lane distance2{}, cos_in{};  // in a medium the mean collision rate stands in for the cosine (mis.h)
  LaneMask valid;              // both normals on wo's side; on camera paths the geometric one decides
  Lane u{}, tv{};              // texture coordinates
  /// Uniforms for the direction that the path goes on in, if they are drawn: the first has let the path
  /// through surfaces before, or has chosen a mix's part.
  Lane du{}, dv{};
  bool drawn = false;
  LaneMask chosen = splat_mask<Lane>(false);  // where it has
};

/// Where the segment that ends now began. The path's ray begins at the last boundary of a medium.
inline Vec3<Lane> segment_start(const MediaWork& m, LaneInt slot) {
  return {gather(m.start[0], slot), gather(m.start[1], slot), gather(m.start[2], slot)};
}

/// What textures may ask of the rays of a group, which are `segment` long.
inline void describe_rays(const RenderScene& scene, const Paths& paths, const Group& g, const Vec3<Lane>& wo,
                          const Vec3<Lane>& segment, int depth, std::array<RayAtPoint, kLanes>& rays) {
  const Lane length = sqrt(dot(segment, segment));
  for (unsigned bits = mask_bits(g.active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    RayAtPoint& ray = rays[static_cast<size_t>(l)];
    ray = {{lane(wo.x, l), lane(wo.y, l), lane(wo.z, l)}};
    ray.length = std::ldexp(lane(length, l), -scene.scale_exponent);
    ray.depth = depth - 1;
    const RayKinds kinds = paths.kinds[lane(g.slot, l)];
    ray.camera = (kinds & kCameraRays) != 0;
    ray.diffuse = (kinds & (kDiffuseRays | kVolumeRays)) == kDiffuseRays;
    ray.singular = (kinds & kSharpRays) != 0;
    ray.glossy = (kinds & kGlossyRays) != 0;
    ray.transmitted = (kinds & kTransmissionRays) != 0;
  }
}

/// `stream`: of the paths, which choose parts of mixes by the number that also chooses a direction; null: a
/// hash of the point does. `bodies`: where these paths leave the bodies of these numbers.
template <class K>
Hit reconstruct(const RenderScene& scene, const Wavefront& w, const Group& g, Mode mode, int depth,
                const SampleStream<Lane>* stream = nullptr, const LaneInt* bodies = nullptr) {
  Hit h;
  h.path = load_paths<Lane>(w.paths, g.slot);
  const LaneInt prim = h.path.prim;
  const Vec3<Lane>&o = h.path.origin, &d = h.path.direction;
  Surface<Lane> s = surface_at<Lane, K::kSurfaces>(scene, prim, h.path.instance, o, d,
                                                   times_of_slots(scene, w.paths, g.slot));
  VertexLanes<Lane>& v = h.v;
  v.p = s.p;
  v.error = s.error;
  v.ng = s.ng;
  v.wo = -d;
  v.throughput = h.path.throughput;
  LaneInt material = gather(scene.primitive_material.data(), prim);
  std::optional<std::array<RayAtPoint, kLanes>> rays;
  if (K::kSurfaces && scene.textures.any_of_ray() && mode == Mode::kRadiance) {
    describe_rays(scene, w.paths, g, v.wo, s.p - o, depth, rays.emplace());
    s.rays = rays->data();
  }
  const bool separates = K::kSurfaces && mode == Mode::kRadiance && separates_lobes(scene);
  h.drawn = stream && (w.alphas || scene.any_mix || separates);
  if (h.drawn) stream->get_2d(vertex_dim(depth, kDimBsdfDirection), &h.du, &h.dv);
  const Lane whole = h.du;
  if (h.drawn && w.alphas) {
    const Lane left = gather(w.alphas->left, g.slot);
    h.du = select(LaneMask(left < 0.0f), h.du, left);
  }
  Lane mix_scale = splat<Lane>(1.0f);
  if (K::kSurfaces && scene.any_mix) {
    material = resolve_mixes<Lane>(scene, material, g.active, prim, s, &mix_scale, h.drawn ? &h.du : nullptr,
                                   bodies);
  }
  if (K::kSurfaces && scene.any_weighted_mix) v.throughput = v.throughput * mix_scale;
  v.ns = K::kSurfaces && scene.any_bumps ? bumped_normals<Lane>(scene, material, g.active, s) : s.ns;
  if (K::kSurfaces && scene.pixel_camera && mode == Mode::kRadiance)
    v.ns = normals_to_viewer<Lane>(scene, material, g.active, v.ns, v.ng, v.wo);
  v.kind = bsdf_at<Lane, K::kSurfaces>(scene, material, g.active, s, &v.params);
  if (separates && h.drawn)
    v.throughput =
        v.throughput * choose_lobe_class<Lane>(v.kind, g.active, dot(v.ns, v.wo), &v.params, &h.du);
  if (h.drawn) h.chosen = LaneMask(h.du != whole);
  if (K::kSurfaces && scene.any_fibres)
    face_fibres<Lane>(scene, s, prim, v.wo, v.kind, &v.p, &v.ng, &v.ns, &v.params);
  if (K::kSurfaces && scene.any_anisotropy)
    orient_lobes<Lane>(scene, material, g.active, s, v.ns, v.kind, &v.params);
  h.u = s.u, h.tv = s.v;
  v.path = g.slot;
  v.depth = splat_int<Lane>(depth);
  if constexpr (K::kMedia) {
    const LaneInt sides = gather(scene.primitive_media.data(), prim);
    v.media = sides_met<Lane>(sides, h.path.medium);
    // A pane that is met at all reflects.
    if (scene.any_panes) {
      const LaneMask pane = mask_and(LaneMask(sides < 0), LaneMask(v.kind == kThinDielectric));
      v.params.p[1] = select(pane, splat<Lane>(1.0f), v.params.p[1]);
    }
    h.path.origin = segment_start(*w.media, g.slot);
  }
  const Vec3<Lane> segment = s.p - o;
  h.distance2 = dot(segment, segment);
  const Lane cos_g = dot(s.ng, v.wo);
  h.cos_in = max(abs(cos_g), splat<Lane>(1e-12f));
  const Lane cos_s = dot(v.ns, v.wo);
  h.valid =
      mask_and(g.active, LaneMask(cos_g * (mode == Mode::kRadiance ? copysign(cos_s, cos_g) : cos_s) > 0.0f));
  v.dvcm = h.path.dvcm;
  v.dvc = h.path.dvc;
  return h;
}

/// The vertex of paths that ended in a medium. Both normals are wo, the axis of the phase function.
inline Hit collision(const RenderScene& scene, const Wavefront& w, const Group& g, int depth) {
  Hit h;
  const MediaWork& m = *w.media;
  h.path = load_paths<Lane>(w.paths, g.slot);
  h.path.origin = segment_start(m, g.slot);
  const MediumRecord<Lane> medium(scene.media.data(), h.path.medium);
  VertexLanes<Lane>& v = h.v;
  v.p = {gather(m.end[0], g.slot), gather(m.end[1], g.slot), gather(m.end[2], g.slot)};
  v.wo = v.ng = v.ns = -h.path.direction;
  v.throughput = h.path.throughput;
  v.kind = splat_int<Lane>(kPhaseFunction);
  v.params.p[0] = medium.scalar(kMediumG);
  v.params.p[kPhaseRateSlot] = h.cos_in = gather(m.end_rate, g.slot);
  v.params.tables = scene.bsdf_tables.data();
  v.media = h.path.medium | (h.path.medium << kMediumBits);
  v.path = g.slot;
  v.depth = splat_int<Lane>(depth);
  const Vec3<Lane> segment = v.p - h.path.origin;
  h.distance2 = dot(segment, segment);
  h.valid = mask_and(g.active, LaneMask(max_component(v.throughput) > 0.0f));
  v.dvcm = h.path.dvcm;
  v.dvc = h.path.dvc;
  return h;
}

/// The vertex where paths leave a body: that of their ray, as seen from outside (M11). `wo` stands for where
/// the path came from. For camera paths it is the shading normal, which has no mirror image (viewer_side.h).
/// For light paths it is the direction on which both normals agree, so that nothing is corrected.
template <class K>
Hit leave_body(const RenderScene& scene, const Wavefront& w, const Group& g, Mode mode, int depth) {
  const BodyWalks& walks = *w.bodies;
  const LaneInt bodies = gather(walks.body, g.slot);
  Hit h = reconstruct<K>(scene, w, g, mode, depth, nullptr, &bodies);
  VertexLanes<Lane>& v = h.v;
  const Lane outside = gather(walks.outside, g.slot), tilt = dot(v.ng, v.ns);
  h.valid = mask_and(g.active, LaneMask(tilt > 0.0f));
  v.wo = v.ns;
  if (mode == Mode::kImportance) v.wo = select(h.valid, normalize(v.ns + v.ng), v.ns);
  v.wo = v.wo * outside;
  h.cos_in = max(abs(dot(v.ng, v.wo)), splat<Lane>(1e-12f));
  v.kind = select(LaneMask(v.kind == kRoughSubsurface), splat_int<Lane>(kRoughSubsurfaceExit),
                  splat_int<Lane>(kSubsurfaceExit));
  v.throughput = v.throughput * albedo_from_both_ends(walks, g.slot, v.params.rgb(0));
  h.valid = mask_and(h.valid, LaneMask(max_component(v.throughput) > 0.0f));
  return h;
}

}  // namespace lightmill
