#include "worker/render/scene/lights/emitter_pattern.h"

#include <algorithm>

#include "worker/render/scene/geometry/sphere_hit.h"

namespace lightmill {
namespace {

/// Texture coordinates of a sampled point.
void coordinates(const EmitterPattern& pattern, bool sphere, float b1, float b2, const Vec3<float>& n,
                 float* u, float* v) {
  const auto& f = pattern.frame;
  if (sphere) {
    const auto along = [&](size_t k) { return n.x * f[k] + n.y * f[k + 1] + n.z * f[k + 2]; };
    sphere_uv(along(0), along(3), along(6), u, v);
    return;
  }
  const float b0 = 1.0f - b1 - b2;
  *u = f[0] * b0 + f[2] * b1 + f[4] * b2;
  *v = f[1] * b0 + f[3] * b1 + f[5] * b2;
}

/// The radiance's factor, and the probability that a ray is stopped.
Vec3<float> shown(const RenderScene& scene, const EmitterPattern& pattern, const TexturePoint& at) {
  if (pattern.texture < 0) return {1, 1, 1};
  const Rgb c = scene.textures.evaluate(pattern.texture, at);
  return {std::max(c.r, 0.0f), std::max(c.g, 0.0f), std::max(c.b, 0.0f)};
}
float stops(const RenderScene& scene, const FloatInput& alpha, const TexturePoint& at) {
  const float a = alpha.texture < 0 ? alpha.value : scene.textures.evaluate(alpha.texture, at).r;
  return a > 0 ? std::min(a, 1.0f) : 0.0f;
}

}  // namespace

Vec3<float> pattern_at_hit(const RenderScene& scene, const EmitterPattern& pattern, const TexturePoint& at) {
  const Vec3<float> c = shown(scene, pattern, at);
  const float a = pattern.whole ? stops(scene, pattern.alpha, at) : 1.0f;
  return a > 0 ? c * (1 / a) : c;
}

Vec3<float> pattern_at_sample(const RenderScene& scene, const EmitterPattern& pattern, bool sphere, float b1,
                              float b2, const Vec3<float>& n, const Vec3<float>& p) {
  TexturePoint at;
  coordinates(pattern, sphere, b1, b2, n, &at.u, &at.v);
  if (scene.any_colors && !sphere) {
    const auto& c = pattern.colors;
    for (size_t k = 0; k < 4; ++k) at.color[k] = c[0][k] * (1.0f - b1 - b2) + c[1][k] * b1 + c[2][k] * b2;
  }
  if (scene.any_second_uvs && !sphere) {
    const auto& uv = pattern.second_uvs;
    const auto along = [&](size_t k) { return uv[0][k] * (1.0f - b1 - b2) + uv[1][k] * b1 + uv[2][k] * b2; };
    at.second_u = along(0), at.second_v = along(1);
  }
  at.p = scene.scene_point({p.x, p.y, p.z});
  at.n = n;
  return shown(scene, pattern, at) * (pattern.whole ? 1.0f : stops(scene, pattern.alpha, at));
}

}  // namespace lightmill
