// LightSource and AreaLightSource. Magnitudes follow pbrt: spectra other than rgb are scaled to luminance 1,
// and "power" or "illuminance" replace the magnitude.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/pbrt_scene.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kMaxScale = 3e38;

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

}  // namespace

void translate_light(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm) {
  static const std::vector<std::string_view> known = {"point", "infinite",    "distant",
                                                      "spot",  "goniometric", "projection"};
  double scale = params.number("scale", 1, 0, kMaxScale);
  if (type == "point") {
    const Rgb intensity = out.spectrum(params, "I", SpectrumUse::kEmission, {1, 1, 1});
    const double power = params.number("power", -1, -kMaxScale, kMaxScale);
    if (power > 0) scale *= power / (4 * std::numbers::pi);
    Vec3d from;
    if (const auto* p = params.numbers("from", ParamType::kPoint3, 3)) from = {(*p)[0], (*p)[1], (*p)[2]};
    const Vec3d position = transform_point(ctm, from);
    if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) {
      out.problems->error(params.where(),
                          params.owner() + " lies outside the range of numbers; check the transform");
    }
    out.scene.lights.push_back(
        {PointLight{checked(scaled(intensity, scale), params), position}, params.where()});
  } else if (type == "infinite") {
    for (const char* name : {"filename", "portal"}) {
      if (!params.has(name)) continue;
      params.unsupported(name, "(an image or a portal of the environment); the light is left out");
      return;
    }
    params.accept({"filename", "portal"});
    const Rgb radiance = out.spectrum(params, "L", SpectrumUse::kEmission, {1, 1, 1});
    const double illuminance = params.number("illuminance", -1, -kMaxScale, kMaxScale);
    if (illuminance > 0) scale *= illuminance / std::numbers::pi;
    out.scene.lights.push_back({InfiniteLight{checked(scaled(radiance, scale), params)}, params.where()});
  } else {
    if (std::find(known.begin(), known.end(), type) == known.end()) {
      report_unknown_word(params, "light", type, known);
    } else {
      out.problems->unsupported(params.where(), params.owner() + " is left out");
    }
    return;
  }
  params.finish();
}

std::shared_ptr<PendingAreaLight> translate_area_light(PbrtScene& out, const std::string& type,
                                                       ParameterList& params) {
  if (type != "diffuse") {
    report_unknown_word(params, "area light", type, {"diffuse"});
    return nullptr;
  }
  auto light = std::make_shared<PendingAreaLight>();
  light->where = params.where();
  const double scale = params.number("scale", 1, 0, kMaxScale);
  if (params.has("filename")) {
    params.unsupported("filename", "(an emission image) is ignored; the light emits evenly");
  }
  params.accept({"filename"});
  const Rgb radiance = out.spectrum(params, "L", SpectrumUse::kEmission, {1, 1, 1});
  light->radiance = checked(scaled(radiance, scale), params);
  light->power = params.number("power", -1, -kMaxScale, kMaxScale);
  light->two_sided = params.boolean("twosided", false);
  params.finish();
  return light;
}

}  // namespace lightmill
