#pragma once
// Vertices that are joined to something else, in lanes: which directions they face, and the cosines and
// densities of mis.h at them.
#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/paths/viewer_side.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A group of up to kLanes consecutive vertices.
struct VertexGroup {
  VertexLanes<Lane> v;
  LaneInt index;
  LaneMask active;
  VertexGroup(const std::vector<Vertex>& from, size_t base, const RenderScene& scene) {
    const auto count = static_cast<int32_t>(std::min<size_t>(kLanes, from.size() - base));
    const LaneInt i = lane_index<Lane>();
    active = LaneMask(i < count);
    index = i + static_cast<int32_t>(base);
    v = load_vertices(from.data() + base, select(active, i, splat_int<Lane>(count - 1)));
    v.params.tables = scene.bsdf_tables.data();
  }
};

/// Whether `w` is on the same side of both normals.
template <class K>
LaneMask consistent(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const LaneMask same = LaneMask(dot(v.ng, w) * dot(v.ns, w) > 0.0f);
  return K::kMedia ? mask_or(same, LaneMask(v.kind == kPhaseFunction)) : same;
}

/// The same for a direction towards the camera, where the geometric normal decides (viewer_side.h).
template <class K>
LaneMask faces_viewer(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const LaneMask some = LaneMask(dot(v.ng, w) * dot(v.ns, w) != 0.0f);
  return K::kMedia ? mask_or(some, LaneMask(v.kind == kPhaseFunction)) : some;
}

/// `w`, a direction towards the camera, in the frame of v.ns as the BSDF is to see it.
inline Vec3<Lane> local_viewer(const StageContext& context, const VertexLanes<Lane>& v,
                               const Frame<Lane>& frame, const Vec3<Lane>& w) {
  const Vec3<Lane> local = frame.to_local(w);
  return context.scene.any_shading_normals() ? viewer_direction(local, dot(v.ng, w)) : local;
}

/// Density with which light paths go from the camera vertex `v` to the one before. `bsdf_density`: that of
/// the BSDF.
inline Lane reverse_density(const StageContext& context, const VertexLanes<Lane>& v, Lane bsdf_density) {
  return context.scene.any_shading_normals() ? bsdf_density * viewer_density(v, v.wo) : bsdf_density;
}

/// `cosine` on surfaces; 1 in a medium, which has none.
template <class K>
Lane shading_cosine(const VertexLanes<Lane>& v, Lane cosine) {
  return K::kMedia ? select(LaneMask(v.kind == kPhaseFunction), splat<Lane>(1.0f), cosine) : cosine;
}

/// wo.ns| |wi.ng| / |wo.ng|: the cosine of a light-path vertex with the adjoint correction.
template <class K>
Lane adjoint_cosine(const VertexLanes<Lane>& v, const Vec3<Lane>& wi) {
  return shading_cosine<K>(
      v, abs(dot(v.wo, v.ns)) * abs(dot(wi, v.ng)) / max(abs(dot(v.wo, v.ng)), splat<Lane>(1e-12f)));
}

/// Turns a density per unit solid angle into one at the vertex, seen along `w`: the cosine to the geometric
/// normal, in a medium the mean collision rate (mis.h).
template <class K>
Lane density_cosine(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const Lane cosine = abs(dot(v.ng, w));
  if constexpr (!K::kMedia) return cosine;
  return select(LaneMask(v.kind == kPhaseFunction), v.params.p[kPhaseRateSlot], cosine);
}

/// The seed of a connection's walk through grids, if there are any.
inline UintOf<Lane> volume_seed(const StageContext& context, const SampleStream<Lane>& stream, uint32_t dim) {
  return context.scene.volumes.empty() ? UintOf<Lane>{} : stream.get_seed(dim);
}

/// The medium that a segment from `v` in direction `w` starts in.
inline LaneInt medium_towards(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  return medium_on_side<Lane>(v.media, LaneMask(dot(v.ng, w) > 0.0f));
}

}  // namespace lightmill
