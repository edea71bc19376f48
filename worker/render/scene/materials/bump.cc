#include "worker/render/scene/materials/bump.h"

namespace lightmill {
namespace {

using Vec = Vec3<float>;

/// `n` made a unit vector on the side of s.ng, or s.ns if it has no direction.
Vec finish(const Surface<float>& s, const Vec& n) {
  const float n2 = dot(n, n);
  if (!(n2 > 0x1p-100f && n2 < 0x1p100f)) return s.ns;
  const Vec unit = n * (1 / std::sqrt(n2));
  return dot(unit, s.ng) < 0 ? -unit : unit;
}

Vec mapped(const RenderScene& scene, const MaterialEntry& m, const Surface<float>& s) {
  const Rgb c = scene.textures.evaluate(m.normal_map, texture_point(scene, s, 0));
  const Vec x = unit_tangent(s.dpdu, s.ns);
  Vec y = cross(s.ns, x);
  if (m.normal_follows_v && dot(y, s.dpdv) < 0) y = -y;
  return x * ((2 * c.r - 1) * m.normal_scale) + y * ((2 * c.g - 1) * m.normal_scale) + s.ns * (2 * c.b - 1);
}

Vec lifted(const RenderScene& scene, int texture, const Surface<float>& s) {
  // Heights are in scene units, derivatives of the position in normalised space.
  const float unit = std::ldexp(1.0f, scene.scale_exponent);
  const auto height = [&](float du, float dv) {
    Surface<float> moved = s;
    moved.u += du;
    moved.v += dv;
    moved.p = s.p + s.dpdu * du + s.dpdv * dv;
    return scene.textures.evaluate(texture, texture_point(scene, moved, 0)).r * unit;
  };
  const float h = height(0, 0);
  const float du = s.u + kBumpStep - s.u, dv = s.v + kBumpStep - s.v;  // the steps that float took
  const float slope_u = du > 0 ? (height(du, 0) - h) / du : 0,
              slope_v = dv > 0 ? (height(0, dv) - h) / dv : 0;
  // Within the plane of the shading normal.
  const Vec t = s.dpdu - s.ns * dot(s.dpdu, s.ns), b = s.dpdv - s.ns * dot(s.dpdv, s.ns);
  return cross(t + s.ns * slope_u, b + s.ns * slope_v);
}

}  // namespace

Vec bumped_normal(const RenderScene& scene, const MaterialEntry& material, const Surface<float>& s) {
  if (material.shading_normal >= 0) {
    Surface<float> turned = s;
    const Rgb given = scene.textures.evaluate(material.shading_normal, texture_point(scene, s, 0));
    turned.ns = finish(s, scene.textures.normal_of_graph(material.shading_normal, given));
    if (material.displacement < 0) return turned.ns;
    return finish(turned, lifted(scene, material.displacement, turned));
  }
  return finish(
      s, material.normal_map >= 0 ? mapped(scene, material, s) : lifted(scene, material.displacement, s));
}

}  // namespace lightmill
