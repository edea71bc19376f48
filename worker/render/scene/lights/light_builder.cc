#include "worker/render/scene/lights/light_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/error.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

using Record = std::array<float, kLightFloats>;

void set_radiance(Record& r, const Rgb& c) {
  r[kLightRadiance] = c.r;
  r[kLightRadiance + 1] = c.g;
  r[kLightRadiance + 2] = c.b;
}
void set_vec(Record& r, size_t slot, const Vec3d& v) {
  r[slot] = static_cast<float>(v.x);
  r[slot + 1] = static_cast<float>(v.y);
  r[slot + 2] = static_cast<float>(v.z);
}
double mean(const Record& r) {
  return (double{r[kLightRadiance]} + r[kLightRadiance + 1] + r[kLightRadiance + 2]) / 3;
}

Rgb scaled(const Rgb& c, double s) {
  const auto f = [&](float x) { return static_cast<float>(x * s); };
  return {f(c.r), f(c.g), f(c.b)};
}

/// What an environment image gives a surface that faces its +z, by pbrt's sum over the texels above: it
/// counts a texel as 2 pi / n steradians, half of what it is, so that an even sky asked for E shines with 2 E
/// / pi.
double illuminance(const LightImage& image) {
  double sum = 0;
  for (int32_t y = 0; y < image.height; ++y) {
    for (int32_t x = 0; x < image.width; ++x) {
      const float s = (static_cast<float>(x) + 0.5f) / static_cast<float>(image.width),
                  t = (static_cast<float>(y) + 0.5f) / static_cast<float>(image.height);
      const double cosine = double{equal_area_square_to_sphere(s, t).z};
      const float* c =
          &image
               .rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x))];
      if (cosine > 0) sum += (0.2126 * double{c[0]} + 0.7152 * double{c[1]} + 0.0722 * double{c[2]}) * cosine;
    }
  }
  if (!(sum > 0)) {
    throw Error(ErrorKind::kBadScene, image.path +
                                          ": the environment image is black above its horizon, so no "
                                          "\"illuminance\" can be had; leave that out");
  }
  return sum * 2 * M_PI / (static_cast<double>(image.width) * image.height);
}

/// White from all directions, as a map, whose texels can be drawn by how they face a portal.
LightImage even_image() {
  constexpr int32_t kSide = 32;
  return {"", kSide, kSide, std::vector<float>(3 * size_t{kSide} * kSide, 1.0f)};
}

/// Of an angle in degrees, without the cancellation of small ones.
double one_minus_cos(double degrees) {
  const double half = std::sin(degrees * M_PI / 360);
  return 2 * half * half;
}

/// Least area of a lamp, in normalised space.
constexpr double kLeastArea = 1e-30;

/// Power of a spot of intensity 1 that falls as the cosine and by a smoothstep between these two 1 - cos.
double cosine_spot_power(double start, double end) {
  const double inner = 1 - start, outer = 1 - end, width = end - start;
  return 2 * M_PI * ((1 - inner * inner) / 2 + width * (outer / 2 + 0.35 * width));
}

/// The lights that are not shapes, a kind to an overload.
class LightBuilder {
 public:
  LightBuilder(RenderScene* scene, SourceLocation where) : out_(*scene), where_(std::move(where)) {}

  void add(const PointLight& l) {
    if (is_black(l.intensity)) return;
    Record r = at_point(l.position, l.intensity);
    const double power = 4 * M_PI * mean(r);
    out_.lights.add(face(l.radius, &r) ? kFacingLamp : kPointLight, r, power);
  }
  void add(const SpotLight& l) {
    if (is_black(l.intensity)) return;
    Record r = at_point(l.position, l.intensity);
    set_vec(r, kLightN, l.direction);
    const double start = one_minus_cos(l.falloff_start), end = one_minus_cos(l.total_width);
    r[4] = static_cast<float>(start);
    r[5] = static_cast<float>(end);
    r[6] = l.falls_as_cosine ? 1 : 0;
    const double power = mean(r) * (l.falls_as_cosine ? cosine_spot_power(start, end) : M_PI * (start + end));
    out_.lights.add(face(l.radius, &r) ? kFacingLamp : kSpotLight, r, power);
  }
  void add(const AreaLamp& l) {
    if (is_black(l.radiance)) return;
    Record r{};
    const auto& m = l.light_to_world.m;
    const auto along = [&](size_t axis, double length) {
      const double s = std::ldexp(length, out_.scale_exponent);
      return Vec3d{m[0][axis] * s, m[1][axis] * s, m[2][axis] * s};
    };
    const Vec3d e1 = along(0, l.half_width), e2 = along(1, l.half_height), down = along(2, -1);
    Vec3d n = cross(e1, e2);
    const double across = length(n);
    const double area = across * (l.ellipse ? M_PI : 4);
    if (!(area >= kLeastArea)) {
      out_.warnings.push_back({where_, Severity::kWarning,
                               "the lamp is so small that float can't hold its area; it does not shine"});
      return;
    }
    const double side = (n.x * down.x + n.y * down.y + n.z * down.z < 0 ? -1 : 1) / across;
    n = {n.x * side, n.y * side, n.z * side};
    set_vec(r, kLightP, out_.normalised_point({m[0][3], m[1][3], m[2][3]}));
    set_vec(r, kLightE1, e1);
    set_vec(r, kLightE2, e2);
    set_vec(r, kLightN, n);
    r[kLightArea] = static_cast<float>(area);
    set_radiance(r, scaled(l.radiance, light_scale()));
    const double power = M_PI * area * mean(r);  // whatever the spread
    if (l.spread_degrees < 180) {
      const double h = l.spread_degrees * M_PI / 360, cotangent = 1 / std::tan(h);
      r[kLightOrientation] = static_cast<float>(cotangent);
      set_radiance(r, scaled(l.radiance, light_scale() / (1 - h * cotangent)));
    }
    out_.lights.add(l.ellipse ? kEllipseLamp : kRectangleLamp, r, power);
  }
  void add(const DistantLight& l) {
    if (is_black(l.irradiance)) return;
    Record r = at_infinity();
    set_vec(r, kLightN, l.direction);
    const double power = M_PI * double{r[3]} * r[3];
    if (l.half_angle_degrees == 0) {
      set_radiance(r, scaled(l.irradiance, light_scale()));
      out_.lights.add(kDistantLight, r, power * mean(r));
      return;
    }
    // A cone of even radiance: facing it, E = pi L sin^2(half angle).
    const double width = one_minus_cos(l.half_angle_degrees), solid = M_PI * width * (2 - width);
    set_radiance(r, scaled(l.irradiance, light_scale() * double{static_cast<float>(1 / solid)}));
    if (!std::isfinite(mean(r))) {
      throw Error(ErrorKind::kBadScene,
                  "a sun so small and bright is more than float can hold; widen its \"angle\"");
    }
    r[4] = kSunCone;
    r[5] = static_cast<float>(width);
    out_.lights.add(kInfiniteLight, r, power * mean(r) * solid);
  }
  void add(const InfiniteLight& l) {
    if (is_black(l.radiance)) return;
    Record r = at_infinity();
    set_radiance(r, scaled(l.radiance, light_scale()));
    r[4] = kEvenSky;
    double power = 4 * M_PI * M_PI * double{r[3]} * r[3] * mean(r);
    if (l.portal || !l.image_path.empty()) {
      r[4] = static_cast<float>(out_.lights.environments.size());
      LightImage image =
          l.image_path.empty() ? even_image() : read_environment(l.image_path, l.lat_long, l.least_side);
      if (!shines(image)) return;
      const double f = l.illuminance > 0 ? l.illuminance / illuminance(image) : 1;
      EnvironmentMap& map = out_.lights.environments.emplace_back(
          std::move(image), scaled(l.radiance, f * light_scale()), l.light_to_world);
      power = 4 * M_PI * M_PI * double{r[3]} * r[3] * map.mean_radiance;
      if (l.portal) {
        const Portal& portal = out_.lights.portals.emplace_back(portal_of(*l.portal));
        r[6] = static_cast<float>(out_.lights.portals.size());
        power = double{portal.area} * map.face(portal.normal);
      }
    }
    out_.lights.add(kInfiniteLight, r, power);
  }

  void add(const GoniometricLight& l) {
    if (is_black(l.intensity)) return;
    LightImage image = l.lat_long ? read_environment(l.image_path, true)
                                  : read_light_image(l.image_path, "goniometric image");
    if (!shines(image)) return;
    image.make_grey();
    const double f = l.power > 0 ? l.power / (4 * M_PI * image.mean()) : 1;
    Record r = at_origin(l.light_to_world);
    r[4] = static_cast<float>(out_.lights.goniometers.size());
    Transform image_to_world = l.light_to_world;
    if (!l.lat_long) {  // pbrt's square image has the light's y axis in its middle
      for (auto& row : image_to_world.m) std::swap(row[1], row[2]);
    }
    const EnvironmentMap& map = out_.lights.goniometers.emplace_back(
        std::move(image), scaled(l.intensity, f * area_scale()), image_to_world);
    set_radiance(r, {map.brightest, map.brightest, map.brightest});
    out_.lights.add(kGoniometricLight, r, 4 * M_PI * map.mean_radiance);
  }
  void add(const ProjectionLight& l) {
    if (is_black(l.intensity)) return;
    LightImage image = read_light_image(l.image_path, "projected image");
    if (!shines(image)) return;
    double f = 1;
    if (l.power > 0) {
      // The power of the image by its luminance.
      LightImage luminance = image;
      for (size_t i = 0; i < luminance.rgb.size(); i += 3) {
        float* c = &luminance.rgb[i];
        c[0] = c[1] = c[2] = 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
      }
      f = l.power / ProjectionMap(std::move(luminance), {1, 1, 1}, {}, l.fov_degrees).power;
    }
    Record r = at_origin(l.light_to_world);
    r[4] = static_cast<float>(out_.lights.projectors.size());
    const ProjectionMap& map = out_.lights.projectors.emplace_back(
        std::move(image), scaled(l.intensity, f * area_scale()), l.light_to_world, l.fov_degrees);
    r[5] = 1 / std::sqrt(1 + map.half_x * map.half_x + map.half_y * map.half_y);
    std::copy(map.to_light + 6, map.to_light + 9, r.begin() + kLightN);
    set_radiance(r, {map.brightest, map.brightest, map.brightest});
    out_.lights.add(kProjectionLight, r, map.power);
  }

 private:
  /// Makes a light at a point a facing lamp, if it has a radius.
  bool face(double radius, Record* r) const {
    const double size = std::ldexp(radius, out_.scale_exponent), area = M_PI * size * size;
    if (!(area >= kLeastArea)) return false;  // a point, as far as float can tell
    (*r)[3] = static_cast<float>(size);
    (*r)[kLightArea] = static_cast<float>(area);
    for (size_t i = 0; i < 3; ++i)
      (*r)[kLightRadiance + i] = static_cast<float>((*r)[kLightRadiance + i] / area);
    return true;
  }
  /// False, and said, for a black image: other lights may be there.
  bool shines(const LightImage& image) {
    if (image.mean() > 0) return true;
    out_.warnings.push_back(
        {where_, Severity::kWarning, image.path + ": the light's image is black; the light is left out"});
    return false;
  }
  Portal portal_of(const std::array<Vec3d, 4>& world) const {
    std::array<Vec3d, 4> corners;
    for (size_t i = 0; i < corners.size(); ++i) corners[i] = out_.normalised_point(world[i]);
    return make_portal(corners, out_.bounds_center, out_.bounds_radius);
  }
  double light_scale() const { return std::ldexp(1.0, -out_.light_exponent); }
  /// Intensities are scaled with the square of lengths, too.
  double area_scale() const { return std::ldexp(light_scale(), 2 * out_.scale_exponent); }
  Record at_origin(const Transform& light_to_world) const {
    const auto& m = light_to_world.m;
    return at_point({m[0][3], m[1][3], m[2][3]}, {});
  }
  Record at_point(const Vec3d& position, const Rgb& intensity) const {
    Record r{};
    set_vec(r, kLightP, out_.normalised_point(position));
    set_radiance(r, scaled(intensity, area_scale()));
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
  const SourceLocation where_;
};

}  // namespace

std::string place(const SourceLocation& where) {
  return where.file + ":" + std::to_string(where.line) + ":" + std::to_string(where.column) + ": ";
}

namespace {

/// Gives the last light of `scene` its steps, as if each were a light of its own.
void add_steps(const LightDescription& light, LightBuilder& builder, RenderScene* scene) {
  LightTable lights = std::exchange(scene->lights, LightTable{});
  const int32_t last = lights.count() - 1;
  const float* record = &lights.records[static_cast<size_t>(last) * kLightFloats];
  std::vector<float> steps(record, record + kMovingFloats);
  for (const LightKind& kind : light.later) {
    scene->lights = {};
    std::visit([&](const auto& l) { builder.add(l); }, kind);
    if (scene->lights.count() == 1) record = scene->lights.records.data();
    steps.insert(steps.end(), record, record + kMovingFloats);
  }
  scene->lights = std::move(lights);
  scene->lights.set_moving(last, steps);
}

}  // namespace

void add_light(const LightDescription& light, RenderScene* scene) {
  LightBuilder builder(scene, light.location);
  const int32_t before = scene->lights.count();
  try {
    std::visit([&](const auto& l) { builder.add(l); }, light.kind);
    if (!light.later.empty() && scene->lights.count() == before + 1) add_steps(light, builder, scene);
    if (scene->lights.count() > before) {
      scene->join_light_group(light.light_group);
      scene->lights.hide(light.hidden);
    }
    scene->hides |= light.hidden;
  } catch (const Error& e) {
    if (light.location.file.empty()) throw;
    throw Error(e.kind(), place(light.location) + e.what());
  }
}

}  // namespace lightmill
