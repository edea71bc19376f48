#include "worker/render/scene/geometry/alpha_mask.h"

#include "worker/render/sampling/sobol.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {
namespace {

/// In [0, 1), 24 bits.
float hash_ray(int32_t prim, int32_t instance, const Vec3<float>& o, const Vec3<float>& d) {
  uint32_t h = hash32(static_cast<uint32_t>(prim));
  if (instance >= 0) h = hash_combine(h, static_cast<uint32_t>(instance));
  for (const float x : {o.x, o.y, o.z, d.x, d.y, d.z}) h = hash_combine(h, float_bits(x));
  return static_cast<float>(h >> 8) * 0x1p-24f;
}

/// The ray as textures see it, and normals of the point that know their outside. Whose it is, is not known
/// here.
RayAtPoint ray_that_meets(const RenderScene& scene, int32_t prim, int32_t instance, float time,
                          const Vec3<float>& o, const Vec3<float>& d, TexturePoint* at) {
  RayAtPoint ray;
  ray.camera = false;
  if (instance >= 0) {
    const bool flips = (scene.primitive_flags[static_cast<size_t>(prim)] & RenderScene::kFlip) != 0;
    if (flips) at->n = -at->n;
    ray.towards = normalize(-Placement<float>::of(scene, instance, time, 1).scaled_vector(d));
    return ray;
  }
  const Surface<float> s = placed_surface<float, true>(scene, prim, NoPlacement<float>{}, o, d);
  at->n = s.ng;
  at->ns = s.ns;
  ray.towards = normalize(-d);
  return ray;
}

}  // namespace

float alpha_at(const RenderScene& scene, const FloatInput& alpha, int32_t prim, int32_t instance, float time,
               const Vec3<float>& o, const Vec3<float>& d, bool shadow) {
  if (alpha.texture < 0) return alpha.value;
  TriangleHit<float> h;
  if (scene.any_bending()) {
    Vec3<float> rounded[3];
    h = bent_triangle_hit<float>(scene, prim, o, d, {scene, prim, time}, rounded);
  } else {
    h = triangle_hit<float>(scene, prim, o, d);
  }
  const CornerUv<float> uv(scene, h, scene.primitive_flags[static_cast<size_t>(prim)]);
  Vec3<float> p = h.p0 * h.b0 + h.p1 * h.b1 + h.p2 * h.b2, e1 = h.e1, e2 = h.e2;
  if (instance >= 0) {
    const auto place = Placement<float>::of(scene, instance, time, 1);
    p = place.point(p), e1 = place.scaled_vector(e1), e2 = place.scaled_vector(e2);
  }
  TexturePoint at{uv.u(h), uv.v(h), scene.scene_point({p.x, p.y, p.z})};
  at.n = normalize(cross(e1, e2));
  if (scene.any_colors) interpolate_colors(scene, h, at.color.data());
  if (scene.any_second_uvs) interpolate_second_uvs(scene, h, &at.second_u, &at.second_v);
  RayAtPoint ray;
  if (scene.textures.any_of_ray()) {
    ray = ray_that_meets(scene, prim, instance, time, o, d, &at);
    ray.shadow = shadow;
    at.ray = &ray;
  }
  return scene.textures.evaluate(alpha.texture, at).r;
}

bool alpha_stops(float a, int32_t prim, int32_t instance, const Vec3<float>& o, const Vec3<float>& d) {
  if (a >= 1) return true;
  return a > 0 && hash_ray(prim, instance, o, d) < a;
}

bool meets_back(const RenderScene& scene, int32_t prim, int32_t outwards, const Vec3<float>& d) {
  Vec3<float> p[3];
  for (size_t k = 0; k < 3; ++k) {
    const float* v =
        &scene.positions[static_cast<size_t>(scene.indices[static_cast<size_t>(prim) * 3 + k]) * 3];
    p[k] = {v[0], v[1], v[2]};
  }
  return dot(cross(p[1] - p[0], p[2] - p[0]), d) * static_cast<float>(outwards) > 0;
}

}  // namespace lightmill
