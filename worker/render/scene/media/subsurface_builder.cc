#include "worker/render/scene/media/subsurface_builder.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "worker/render/bsdf/tables/half_space.h"
#include "worker/render/scene/materials/material_slots.h"
#include "worker/render/scene/media/subsurface_body.h"

namespace lightmill {
namespace {

/// Products of two extinctions stay within float.
constexpr double kDensest = 1e18;

double at_least_zero(float x) { return std::isfinite(x) ? std::max(double{x}, 0.0) : 0.0; }

}  // namespace

void build_subsurface(const MaterialDescription& material, CoatMemo* coats, RenderScene* scene,
                      MaterialEntry* entry, float* params) {
  const auto& m = std::get<SubsurfaceMaterial>(material.kind);
  const bool smooth = set_roughness(m.roughness, entry, params);
  entry->kind = smooth ? kSubsurface : kRoughSubsurface;
  const CoatMemo::OverDiffuse& boundary = coats->diffuse({m.eta, 0, smooth ? 0 : params[6]}, {}, false);
  if (!boundary.table.empty()) params[8] = static_cast<float>(add_table(boundary.table, scene));
  params[3] = m.eta;
  params[4] = boundary.entering_mean;

  const auto number = static_cast<int>(scene->bodies.size() / kBodyFloats);
  scene->bodies.resize(scene->bodies.size() + kBodyFloats);
  float* body = scene->bodies.data() + static_cast<size_t>(number) * kBodyFloats;
  params[kBodyNumberSlot] = static_cast<float>(number);
  body[kBodyG] = m.g;
  body[kBodyLeaves] = boundary.entering_mean / (m.eta * m.eta);
  const float a[3] = {m.sigma_a.r, m.sigma_a.g, m.sigma_a.b}, s[3] = {m.sigma_s.r, m.sigma_s.g, m.sigma_s.b},
              free[3] = {m.mfp.r, m.mfp.g, m.mfp.b};
  for (int c = 0; c < 3; ++c) {
    const double scattering = at_least_zero(s[c]), total = at_least_zero(a[c]) + scattering;
    const double extinction = m.reflectance ? 1 / at_least_zero(free[c]) : total;
    if (!m.reflectance) {
      const float albedo = total > 0 ? static_cast<float>(scattering / total) : 1;
      params[c] = walk_albedo({m.eta, 0, smooth ? 0 : params[6]}, albedo, m.g, body[kBodyLeaves]);
    }
    // Lengths are 2^scale_exponent times what they are in scene units.
    const double scaled = std::ldexp(extinction, -scene->scale_exponent);
    if (!(scaled < kDensest)) {
      const SourceLocation& at = material.location;
      throw Error(ErrorKind::kBadScene, at.file + ":" + std::to_string(at.line) + ":" +
                                            std::to_string(at.column) +
                                            ": a subsurface material is opaque within 1e-18 of the scene's "
                                            "extent; lower its \"scale\", or raise its \"mfp\"");
    }
    body[kBodyExtinction + c] = static_cast<float>(scaled);
  }
  if (!m.reflectance) return;
  entry->texture_color = m.reflectance->texture;
  set_subsurface_reflectance(*scene, m.reflectance->value, params);
}

void set_subsurface_reflectance(const RenderScene& scene, const Rgb& c, float* params) {
  const float* body = scene.bodies.data() + static_cast<size_t>(params[kBodyNumberSlot]) * kBodyFloats;
  const auto albedo = [&](float r) {
    return albedo_of_body(reflectance(r), body[kBodyLeaves], body[kBodyG]);
  };
  set_rgb(params, 0, {albedo(c.r), albedo(c.g), albedo(c.b)});
}

}  // namespace lightmill
