#include "worker/render/scene/light_builder.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error.h"

namespace lightmill {
namespace {

using Record = std::array<float, kLightFloats>;

bool dark(const Rgb& c) { return !(c.r > 0 || c.g > 0 || c.b > 0); }

void set_radiance(Record& r, const Rgb& c, float scale = 1) {
  r[kLightRadiance] = c.r * scale;
  r[kLightRadiance + 1] = c.g * scale;
  r[kLightRadiance + 2] = c.b * scale;
}
void set_vec(Record& r, size_t slot, const Vec3d& v) {
  r[slot] = static_cast<float>(v.x);
  r[slot + 1] = static_cast<float>(v.y);
  r[slot + 2] = static_cast<float>(v.z);
}
double mean(const Record& r) {
  return (double{r[kLightRadiance]} + r[kLightRadiance + 1] + r[kLightRadiance + 2]) / 3;
}

/// The lights that are not shapes, a kind to an overload.
class LightBuilder {
 public:
  explicit LightBuilder(RenderScene* scene) : out_(*scene) {}

  void add(const PointLight& l) {
    if (dark(l.intensity)) return;
    Record r = at_point(l.position, l.intensity);
    out_.lights.add(kPointLight, r, 4 * M_PI * mean(r));
  }
  void add(const SpotLight& l) {
    if (dark(l.intensity)) return;
    Record r = at_point(l.position, l.intensity);
    set_vec(r, kLightN, l.direction);
    const double start = std::cos(l.falloff_start * M_PI / 180), end = std::cos(l.total_width * M_PI / 180);
    r[4] = static_cast<float>(start);
    r[5] = static_cast<float>(end);
    out_.lights.add(kSpotLight, r, 2 * M_PI * (1 - 0.5 * (start + end)) * mean(r));
  }
  void add(const DistantLight& l) {
    if (dark(l.irradiance)) return;
    Record r = at_infinity();
    set_vec(r, kLightN, l.direction);
    const double power = M_PI * double{r[3]} * r[3];
    if (l.half_angle_degrees == 0) {
      set_radiance(r, l.irradiance);
      out_.lights.add(kDistantLight, r, power * mean(r));
      return;
    }
    // A cone of even radiance: facing it, E = pi L sin^2(half angle).
    const double half = std::sin(l.half_angle_degrees * M_PI / 360), one_minus_cos = 2 * half * half;
    const double solid = M_PI * one_minus_cos * (2 - one_minus_cos);
    set_radiance(r, l.irradiance, static_cast<float>(1 / solid));
    if (!std::isfinite(mean(r))) {
      throw Error(ErrorKind::kBadScene,
                  "a sun so small and bright is more than float can hold; widen its \"angle\"");
    }
    r[4] = kSunCone;
    r[5] = static_cast<float>(one_minus_cos);
    out_.lights.add(kInfiniteLight, r, power * mean(r) * solid);
  }
  void add(const InfiniteLight& l) {
    if (dark(l.radiance)) return;
    Record r = at_infinity();
    set_radiance(r, l.radiance);
    r[4] = kEvenSky;
    double radiance = mean(r);
    if (!l.image_path.empty()) {
      r[4] = static_cast<float>(out_.lights.environments.size());
      const EnvironmentMap& map =
          out_.lights.environments.emplace_back(l.image_path, l.radiance, l.light_to_world, l.lat_long);
      radiance = map.mean_radiance;
    }
    out_.lights.add(kInfiniteLight, r, 4 * M_PI * M_PI * double{r[3]} * r[3] * radiance);
  }

 private:
  Record at_point(const Vec3d& position, const Rgb& intensity) const {
    Record r{};
    set_vec(r, kLightP, out_.normalised_point(position));
    set_radiance(r, intensity, std::ldexp(1.0f, 2 * out_.scale_exponent));
    r[kLightArea] = 1;
    return r;
  }
  /// With the disk across the scene from which lights at infinity emit.
  Record at_infinity() const {
    Record r{};
    std::copy(out_.bounds_center, out_.bounds_center + 3, r.begin());
    r[3] = out_.bounds_radius;
    r[kLightArea] = 1;
    return r;
  }

  RenderScene& out_;
};

int32_t add_emitter(LightType type, Record& r, const EmitterSource& source, double area, RenderScene* scene) {
  const AreaLightDescription& light = source.light;
  set_radiance(r, light.radiance);
  r[kLightArea] = static_cast<float>(area);
  r[kLightTwoSided] = light.two_sided ? 1 : 0;
  scene->lights.add(type, r, M_PI * area * mean(r) * (light.two_sided ? 2 : 1));
  return scene->lights.count() - 1;
}

}  // namespace

std::string place(const SourceLocation& where) {
  return where.file + ":" + std::to_string(where.line) + ":" + std::to_string(where.column) + ": ";
}

void add_light(const LightDescription& light, RenderScene* scene) {
  LightBuilder builder(scene);
  try {
    std::visit([&](const auto& l) { builder.add(l); }, light.kind);
  } catch (const Error& e) {
    if (light.location.file.empty()) throw;
    throw Error(e.kind(), place(light.location) + e.what());
  }
}

int32_t add_triangle_emitter(const EmitterSource& source, const int32_t* i, const Vec3d& winding, double area,
                             int32_t flags, RenderScene* scene) {
  if (dark(source.light.radiance)) return -1;
  double sign = flags & RenderScene::kFlip ? -1 : 1;
  if (scene->any_normals) {
    // The side of the vertex normals, as at intersection.
    double along = 0;
    for (int k = 0; k < 3; ++k) {
      const float* n = &scene->normals[static_cast<size_t>(i[k]) * 3];
      along += n[0] * winding.x + n[1] * winding.y + n[2] * winding.z;
    }
    if (along != 0) sign = along < 0 ? -1 : 1;
  }
  Record r{};
  for (size_t c = 0; c < 3; ++c) {
    const float v0 = scene->positions[static_cast<size_t>(i[0]) * 3 + c];
    r[kLightP + c] = v0;
    r[kLightE1 + c] = scene->positions[static_cast<size_t>(i[1]) * 3 + c] - v0;
    r[kLightE2 + c] = scene->positions[static_cast<size_t>(i[2]) * 3 + c] - v0;
  }
  set_vec(r, kLightN, {sign * winding.x, sign * winding.y, sign * winding.z});
  return add_emitter(kTriangleLight, r, source, area, scene);
}

int32_t add_sphere_emitter(const EmitterSource& source, bool reverse_orientation, RenderScene* scene) {
  if (dark(source.light.radiance)) return -1;
  Record r{};
  std::copy(scene->spheres.end() - 4, scene->spheres.end(), r.begin());
  r[kLightOrientation] = reverse_orientation ? -1 : 1;
  const double radius = double{r[3]};
  return add_emitter(kSphereLight, r, source, 4 * M_PI * radius * radius, scene);
}

}  // namespace lightmill
