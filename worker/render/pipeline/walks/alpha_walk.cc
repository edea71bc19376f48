#include "worker/render/pipeline/walks/alpha_walk.h"

#include <algorithm>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/geometry/placement.h"

namespace lightmill {
namespace {

const MeshRange& mesh_of(const RenderScene& scene, int32_t prim) {
  const auto after = std::upper_bound(scene.meshes.begin(), scene.meshes.end(), prim,
                                      [](int32_t p, const MeshRange& m) { return p < m.first_triangle; });
  return *(after - 1);
}

/// Alpha where a ray has met triangle `ray.prim`.
float alpha_met(const RenderScene& scene, const TracedRay& ray, float time) {
  const FloatInput& alpha = mesh_of(scene, ray.prim).alpha;
  Vec3<float> o{ray.origin[0], ray.origin[1], ray.origin[2]};
  Vec3<float> d{ray.direction[0], ray.direction[1], ray.direction[2]};
  if (ray.instance >= 0 && alpha.texture >= 0) {
    const auto place = Placement<float>::of(scene, ray.instance, time, 1);
    o = place.origin(o), d = place.direction(d);
  }
  return alpha_at(scene, alpha, ray.prim, ray.instance, time, o, d);
}

float first_number(const LayerContext& layer, bool light, int depth, int32_t slot) {
  const SampleStream<float> stream =
      light ? layer.light_stream<float>(slot) : layer.camera_stream<float>(slot);
  float u = 0, v = 0;
  stream.get_2d(vertex_dim(depth, kDimBsdfDirection), &u, &v);
  return u;
}

}  // namespace

void cast_through_alpha(const StageContext& context, const LayerContext& layer, bool light, int depth,
                        KindsOfRays kinds, Wavefront& w) {
  const RenderScene& scene = context.scene;
  Paths& paths = w.paths;
  AlphaWork& work = *w.alphas;
  const float* times = times_of_rays(scene, paths);
  work.undecided.assign(paths.active, paths.active + paths.active_count);
  for (const int32_t slot : work.undecided) {
    work.left[slot] = -1;
    work.passed.of[static_cast<size_t>(slot)].count = 0;
  }
  while (!work.undecided.empty()) {
    const auto count = static_cast<int>(work.undecided.size());
    context.accel.closest_hits(paths.rays, work.undecided.data(), count, times, kinds, &work.passed);
    w.counters.closest_hit_rays += static_cast<uint64_t>(count);
    std::swap(work.met, work.undecided);
    work.undecided.clear();
    for (const int32_t slot : work.met) {
      const TracedRay& ray = paths.rays[slot];
      const auto id = static_cast<size_t>(slot);
      const bool masked = ray.prim >= 0 && ray.prim < scene.triangle_count() &&
                          scene.primitive_flags[static_cast<size_t>(ray.prim)] & RenderScene::kMasked;
      if (!masked || work.passed.full(id)) continue;
      const float a = alpha_met(scene, ray, times ? times[slot] : 0);
      if (a >= 1) continue;
      float& left = work.left[slot];
      if (left < 0) left = first_number(layer, light, depth, slot);
      if (choose_lobe(a, &left)) continue;  // it stops
      work.passed.add(id, ray.prim, ray.instance);
      work.undecided.push_back(slot);
    }
  }
}

}  // namespace lightmill
