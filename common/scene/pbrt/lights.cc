// LightSource and AreaLightSource. Magnitudes follow pbrt: spectra other than rgb are scaled to luminance 1,
// and "power" or "illuminance" replace the magnitude.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/pbrt/scene.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kMaxScale = 3e38;
/// Narrower suns (degrees) are lost in the rounding of directions.
constexpr double kLeastSunAngle = 1e-5;
/// Of lamps (degrees): what Cycles takes as its least, too.
constexpr double kLeastSpread = 1;
/// 180, but for rounding.
constexpr double kNoSpread = 180.001;
/// Of small panoramas, whose texels Blender lets go over into each other.
constexpr int kSmoothSide = 256;

/// Of projections (degrees): beyond, the window is a point or the whole half space.
constexpr double kLeastFov = 1e-3, kGreatestFov = 179.9;

/// 1 - the cosine of an angle in degrees, without the cancellation of small ones.
double versine(double degrees) {
  const double half = std::sin(degrees * std::numbers::pi / 360);
  return 2 * half * half;
}

Rgb scaled(const Rgb& c, double s) {
  return {static_cast<float>(c.r * s), static_cast<float>(c.g * s), static_cast<float>(c.b * s)};
}

bool finite(const Rgb& c) { return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b); }

/// Reports an emission that overflowed float.
Rgb checked(const Rgb& c, ParameterList& params) {
  if (finite(c)) return c;
  params.problems().error(params.where(),
                          params.owner() + " is brighter than float can hold; lower its \"scale\"");
  return {};
}

/// "power" or "illuminance", which replace a light's magnitude where they are above 0; -1 is pbrt's "not
/// given".
double magnitude(ParameterList& params, const char* name) {
  const double x = params.number(name, -1, -kMaxScale, kMaxScale);
  if (x <= 0 && x != -1) {
    params.problems().warning(params.where_of(name), "parameter " + in_quotes(name) + " of " +
                                                         params.owner() +
                                                         " is not above 0 and is ignored; leave it out");
  }
  return x;
}

/// A colour beside an image, which pbrt-v4 refuses and pbrt-v3 multiplies: so do we.
Rgb image_tint(ParameterList& params, PbrtScene& out, const char* name) {
  if (params.has(name) && out.dialect == Dialect::kV4) {
    params.odd_value(name, "is given beside an image, which it multiplies; leave one out");
  }
  return out.spectrum(params, name, SpectrumUse::kEmission, {1, 1, 1});
}

Vec3d end_point(ParameterList& params, const char* name, const Vec3d& fallback) {
  const auto* p = params.numbers(name, ParamType::kPoint3, 3);
  return p ? Vec3d{(*p)[0], (*p)[1], (*p)[2]} : fallback;
}

/// Unit world direction from "from" to "to" (by default along +z).
Vec3d axis(PbrtScene& out, ParameterList& params, const Transform& ctm) {
  const Vec3d from = transform_point(ctm, end_point(params, "from", {0, 0, 0}));
  const Vec3d to = transform_point(ctm, end_point(params, "to", {0, 0, 1}));
  const Vec3d d{to.x - from.x, to.y - from.y, to.z - from.z};
  const double length = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  if (!(length > 0) || !std::isfinite(length)) {
    out.problems->warning(params.where(), params.owner() +
                                              " has no direction; \"from\" and \"to\" must differ; +z is "
                                              "taken");
    return {0, 0, 1};
  }
  return {d.x / length, d.y / length, d.z / length};
}

/// Whether "mapping" asks for a panorama (ours: pbrt-v4's are equal-area alone).
bool is_equirectangular(ParameterList& params) {
  const std::string mapping = params.text("mapping", "equalarea");
  if (mapping != "equalarea" && mapping != "equirectangular") {
    params.odd_value("mapping", "must be \"equalarea\" or \"equirectangular\", not " + in_quotes(mapping) +
                                    "; \"equalarea\" is taken");
  }
  return mapping == "equirectangular";
}

/// "radius" of a lamp at a point: how large a disk it is (ours).
double lamp_radius(ParameterList& params) { return params.number("radius", 0, 0, kAnySize); }

/// A lamp with an area and without a surface (ours): Blender's area lamps.
AreaLamp area_lamp(PbrtScene& out, ParameterList& params, const Transform& ctm, double scale) {
  AreaLamp lamp;
  const std::string shape = params.text("shape", "rectangle");
  lamp.ellipse = shape == "ellipse";
  if (shape != "rectangle" && shape != "ellipse") {
    params.odd_value("shape", "must be \"rectangle\" or \"ellipse\", not " + in_quotes(shape) +
                                  "; \"rectangle\" is taken");
  }
  lamp.half_width = params.number("width", 1, 1e-30, kAnySize) / 2;
  lamp.half_height = params.number("height", 1, 1e-30, kAnySize) / 2;
  lamp.spread_degrees = std::min(180.0, params.number("spread", 180, kLeastSpread, kNoSpread));
  lamp.radiance =
      checked(scaled(out.spectrum(params, "L", SpectrumUse::kEmission, {1, 1, 1}), scale), params);
  lamp.light_to_world = ctm;
  return lamp;
}

/// "blend" of a spot (ours): Cycles' rule. The light falls as the cosine to the axis, and by a smoothstep of
/// it over this part of the way from the axis to the cone's edge.
void read_blend(ParameterList& params, SpotLight* spot) {
  const double blend = params.number("blend", 0, 0, 1);
  const double edge = versine(spot->total_width), start = edge * (1 - blend);
  spot->falloff_start = 2 * std::asin(std::min(1.0, std::sqrt(start / 2))) * 180 / std::numbers::pi;
  spot->falls_as_cosine = true;
  if (spot->total_width > 90) {
    params.odd_value("coneangle", "is above 90, where a spot with \"blend\" gives no light; 90 is taken");
    spot->total_width = 90;
  }
}

/// The file of a light that shines by an image, whose transform should only turn and move it; "" if there is
/// none (`needed`: reported) or it can't be opened (reported).
std::string image_file(PbrtScene& out, ParameterList& params, const Transform& ctm, bool needed) {
  const std::string file = params.text("filename", "");
  if (file.empty()) {
    if (needed) out.problems->error(params.where(), params.owner() + " needs a \"string filename\"");
    return "";
  }
  if (!is_similarity(ctm)) {
    out.problems->warning(params.where(), params.owner() +
                                              " is stretched or sheared by its transform; its image is only "
                                              "turned");
  }
  if (out.may_be_missing(file, params.where_of("filename"))) return "";
  return out.open_reference(file, params.where_of("filename"));
}

/// Corners in world space, whatever the transform (as pbrt reads them), if there are any.
std::optional<std::array<Vec3d, 4>> portal(ParameterList& params) {
  const auto* p = params.numbers("portal", ParamType::kPoint3, 12);
  if (!p) return std::nullopt;
  std::array<Vec3d, 4> corners;
  for (size_t i = 0; i < 4; ++i) corners[i] = {(*p)[3 * i], (*p)[3 * i + 1], (*p)[3 * i + 2]};
  const auto edge = [&](size_t a, size_t b) {
    return Vec3d{corners[b].x - corners[a].x, corners[b].y - corners[a].y, corners[b].z - corners[a].z};
  };
  const auto dot = [](const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  const Vec3d e1 = edge(0, 1), e2 = edge(0, 3), across = edge(1, 2);
  const double size = std::sqrt(dot(e1, e1) * dot(e2, e2));
  const Vec3d bend{across.x - e2.x, across.y - e2.y, across.z - e2.z};
  const double off = std::max(std::abs(dot(e1, e2)), dot(bend, bend));
  if (!(size > 0) || !std::isfinite(size) || !(off <= 1e-3 * size)) {
    params.odd_value("portal", "is not a rectangle and is left out; give its four corners in turn");
    return std::nullopt;
  }
  return corners;
}

}  // namespace

void translate_light(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm) {
  const std::vector<std::string_view> known = {"point",       "infinite",   "distant", "spot",
                                               "goniometric", "projection", "area"};
  double scale = params.number("scale", 1, 0, kMaxScale);
  if (type == "point") {
    const Rgb intensity = out.spectrum(params, "I", SpectrumUse::kEmission, {1, 1, 1});
    const double power = magnitude(params, "power");
    if (power > 0) scale *= power / (4 * std::numbers::pi);
    Vec3d from;
    if (const auto* p = params.numbers("from", ParamType::kPoint3, 3)) from = {(*p)[0], (*p)[1], (*p)[2]};
    const Vec3d position = transform_point(ctm, from);
    if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) {
      out.problems->error(params.where(),
                          params.owner() + " lies outside the range of numbers; check the transform");
    }
    out.scene.lights.push_back(
        {PointLight{checked(scaled(intensity, scale), params), position, lamp_radius(params)},
         params.where()});
  } else if (type == "infinite") {
    InfiniteLight light;
    light.portal = portal(params);
    const double illuminance = magnitude(params, "illuminance");
    light.image_path = image_file(out, params, ctm, false);
    if (!light.image_path.empty()) {
      const Rgb tint = image_tint(params, out, "L");
      light.light_to_world = ctm;
      if (out.dialect == Dialect::kV3) {  // whose panoramas have +z at the top
        light.lat_long = true;
        for (auto& row : light.light_to_world.m) std::swap(row[1], row[2]);
      } else if (is_equirectangular(
                     params)) {  // Blender's: +z at the top, +x in the middle, -y right of that
        light.lat_long = true;
        light.least_side = kSmoothSide;
        for (auto& row : light.light_to_world.m) {
          std::swap(row[1], row[2]);
          row[0] = -row[0];
        }
      }
      light.illuminance = std::max(illuminance, 0.0);
      light.radiance = checked(scaled(tint, scale), params);
      out.scene.lights.push_back({light, params.where()});
      params.finish();
      return;
    }
    const Rgb radiance = out.spectrum(params, "L", SpectrumUse::kEmission, {1, 1, 1});
    if (illuminance > 0) scale *= illuminance / std::numbers::pi;
    light.radiance = checked(scaled(radiance, scale), params);
    out.scene.lights.push_back({light, params.where()});
  } else if (type == "distant") {
    const Rgb radiance = out.spectrum(params, "L", SpectrumUse::kEmission, {1, 1, 1});
    const double illuminance = magnitude(params, "illuminance");
    if (illuminance > 0) scale *= illuminance;
    DistantLight distant;
    distant.irradiance = checked(scaled(radiance, scale), params);
    distant.direction = axis(out, params, ctm);
    distant.half_angle_degrees = params.number("angle", 0, 0, 90);  // ours: pbrt has no sun
    if (distant.half_angle_degrees > 0 && distant.half_angle_degrees < kLeastSunAngle) {
      out.problems->warning(params.where_of("angle"),
                            "a sun of \"angle\" below 1e-5 degrees is a parallel light");
      distant.half_angle_degrees = 0;
    }
    out.scene.lights.push_back({distant, params.where()});
  } else if (type == "spot") {
    const Rgb intensity = out.spectrum(params, "I", SpectrumUse::kEmission, {1, 1, 1});
    SpotLight spot;
    spot.total_width = params.number("coneangle", 30, 0, 180);
    if (spot.total_width < kLeastCone) {
      out.problems->warning(
          params.where_of("coneangle"),
          "a cone narrower than 1e-6 degrees is taken as that: directions are not known better");
      spot.total_width = kLeastCone;
    }
    if (params.has("blend")) {
      read_blend(params, &spot);
    } else {
      spot.falloff_start = std::max(0.0, spot.total_width - params.number("conedeltaangle", 5, 0, 180));
    }
    spot.radius = lamp_radius(params);
    const double power = magnitude(params, "power");
    if (power > 0) {
      // Power of intensity 1: the full cone plus half of the falloff's (pbrt's rule).
      scale *= power / (std::numbers::pi * (versine(spot.falloff_start) + versine(spot.total_width)));
    }
    spot.intensity = checked(scaled(intensity, scale), params);
    spot.position = transform_point(ctm, end_point(params, "from", {0, 0, 0}));
    spot.direction = axis(out, params, ctm);
    out.scene.lights.push_back({spot, params.where()});
  } else if (type == "area") {
    out.scene.lights.push_back({area_lamp(out, params, ctm, scale), params.where()});
  } else if (type == "goniometric") {
    const Rgb intensity = out.spectrum(params, "I", SpectrumUse::kEmission, {1, 1, 1});
    const double power = magnitude(params, "power");
    GoniometricLight light{checked(scaled(intensity, scale), params), image_file(out, params, ctm, true), ctm,
                           std::max(power, 0.0), out.dialect == Dialect::kV3};
    if (!light.image_path.empty()) out.scene.lights.push_back({std::move(light), params.where()});
  } else if (type == "projection") {
    const double power = magnitude(params, "power");
    const double fov = params.number("fov", 90, kLeastFov, kGreatestFov);
    ProjectionLight light{checked(scaled(image_tint(params, out, "I"), scale), params),
                          image_file(out, params, ctm, true), ctm, fov, std::max(power, 0.0)};
    if (!light.image_path.empty()) out.scene.lights.push_back({std::move(light), params.where()});
  } else {
    report_unknown_word(params, "light", type, known, "it is left out");
    return;
  }
  params.finish();
}

std::shared_ptr<PendingAreaLight> translate_area_light(PbrtScene& out, const std::string& type,
                                                       ParameterList& params) {
  if (type != "diffuse") {
    report_unknown_word(params, "area light", type, {"diffuse"}, "\"diffuse\" is taken");
  }
  auto light = std::make_shared<PendingAreaLight>();
  light->where = params.where();
  const double scale = params.number("scale", 1, 0, kMaxScale);
  if (const std::string file = params.text("filename", ""); !file.empty()) {
    light->image_where = params.where_of("filename");
    light->image_path = out.open_image(file, light->image_where);
  }
  SpectrumInput emitted{{1, 1, 1}, -1};
  if (light->image_path) {
    emitted.value = image_tint(params, out, "L");
  } else {
    emitted = out.spectrum_input(params, "L", SpectrumUse::kEmission, {1, 1, 1});  // a texture is ours
  }
  light->texture = emitted.texture;
  const Rgb radiance = emitted.value;
  light->radiance = checked(scaled(radiance, scale), params);
  light->power = magnitude(params, "power");
  light->two_sided = params.boolean("twosided", false);
  params.finish();
  return light;
}

}  // namespace lightmill
