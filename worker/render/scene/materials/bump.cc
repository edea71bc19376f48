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

/// Height of a bump map at the point that lies `du`, `dv` and `way` (the same way in space) from `s`: of
/// normalised space, as the way is, while the texture's are in scene units.
float height(const RenderScene& scene, int texture, const Surface<float>& s, float du, float dv,
             const Vec& way) {
  Surface<float> moved = s;
  moved.u += du;
  moved.v += dv;
  moved.p = s.p + way;
  return std::ldexp(scene.textures.evaluate(texture, texture_point(scene, moved, 0)).r, scene.scale_exponent);
}

Vec lifted(const RenderScene& scene, int texture, const Surface<float>& s) {
  const float h = height(scene, texture, s, 0, 0, {});
  const float du = s.u + kBumpStep - s.u, dv = s.v + kBumpStep - s.v;  // the steps that float took
  const float slope_u = du > 0 ? (height(scene, texture, s, du, 0, s.dpdu * du) - h) / du : 0,
              slope_v = dv > 0 ? (height(scene, texture, s, 0, dv, s.dpdv * dv) - h) / dv : 0;
  // Within the plane of the shading normal.
  const Vec t = s.dpdu - s.ns * dot(s.dpdu, s.ns), b = s.dpdv - s.ns * dot(s.dpdv, s.ns);
  return cross(t + s.ns * slope_u, b + s.ns * slope_v);
}

/// Side of the square that a pixel sees at `p`, across the view: normalised space. For points that the camera
/// does not see it is that of one straight ahead, about.
float pixel_width(const Camera& camera, const Vec& p) {
  return std::visit(
      [&](const auto& c) {
        const auto joined = c.template connect<float>(p, 0.5f, 0.5f);
        return joined.density > 0 ? 1 / std::sqrt(joined.density) : 0.0f;
      },
      camera);
}

/// The height at the point that lies `way` from `s` in its plane.
float height_beside(const RenderScene& scene, int texture, const Surface<float>& s, const Vec& way) {
  // Steps of u and v whose way is this one.
  const float uu = dot(s.dpdu, s.dpdu), uv = dot(s.dpdu, s.dpdv), vv = dot(s.dpdv, s.dpdv),
              det = uu * vv - uv * uv;
  float du = 0, dv = 0;
  if (det > 1e-6f * uu * vv) {
    const float u = dot(s.dpdu, way), v = dot(s.dpdv, way);
    du = (vv * u - uv * v) / det;
    dv = (uu * v - uv * u) / det;
  }
  return height(scene, texture, s, du, dv, way);
}

float bump_strength(const RenderScene& scene, const MaterialEntry& m, const Surface<float>& s) {
  const FloatInput& in = m.bump_strength;
  return in.texture < 0 ? in.value
                        : std::max(scene.textures.evaluate(in.texture, texture_point(scene, s, 0)).r, 0.0f);
}

Vec lifted_by_pixel(const RenderScene& scene, const MaterialEntry& m, const Surface<float>& s) {
  // Not so narrow that the step is lost in the position's bits.
  const float width = std::max(pixel_width(*scene.pixel_camera, s.p), 1e-5f * std::sqrt(dot(s.p, s.p)));
  if (!(width > 0 && width < 0x1p60f)) return s.ns;
  const Frame<float> plane(s.ng);
  const Vec x = plane.s * width, y = plane.t * width;
  const float h = height(scene, m.displacement, s, 0, 0, {});
  const float rise_x = height_beside(scene, m.displacement, s, x) - h,
              rise_y = height_beside(scene, m.displacement, s, y) - h;
  const Vec slope = cross(y, s.ns) * rise_x + cross(s.ns, x) * rise_y;
  const float area = dot(s.ns, cross(x, y));
  const Vec n = s.ns * std::fabs(area) - slope * (area < 0 ? -1.0f : 1.0f);
  const float length = std::sqrt(dot(n, n)), strength = bump_strength(scene, m, s);
  return length > 0 ? s.ns * (1 - strength) + n * (strength / length) : s.ns;
}

Vec lifted(const RenderScene& scene, const MaterialEntry& m, const Surface<float>& s) {
  return m.bump_by_pixel ? lifted_by_pixel(scene, m, s) : lifted(scene, m.displacement, s);
}

}  // namespace

Vec bumped_normal(const RenderScene& scene, const MaterialEntry& material, const Surface<float>& s) {
  Surface<float> turned = s;
  if (material.shading_normal >= 0) {
    const Rgb given = scene.textures.evaluate(material.shading_normal, texture_point(scene, s, 0));
    turned.ns = finish(s, scene.textures.normal_of_graph(material.shading_normal, given));
  } else if (material.normal_map >= 0) {
    turned.ns = finish(s, mapped(scene, material, s));
  }
  return material.displacement >= 0 ? finish(turned, lifted(scene, material, turned)) : turned.ns;
}

}  // namespace lightmill
