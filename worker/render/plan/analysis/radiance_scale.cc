#include "worker/render/plan/analysis/radiance_scale.h"

#include <algorithm>
#include <cmath>

#include "common/film/exact_sum.h"

namespace lightmill {
namespace {

/// Contributions go up to 2^40 of the scale: with this factor a point light may be 2^-25 of the scene's
/// extent away, the last bit of a position.
constexpr double kPointLightRoom = 0x1p10;

/// A lamp that is far brighter than the light that it spreads, a tiny one, is put this far above the scale at
/// most: contributions may still be 2^20 times as bright as it is.
constexpr double kTinyLampRoom = 0x1p20;
/// Then the scale is this far above the radiance of the lights' power spread evenly: faint light is summed in
/// steps of 2^-40 of that.
constexpr double kFaintRoom = 0x1p12;

/// What is seen may be this far below the scale, so that faint values have 16 bits and more, and this far
/// above it, which leaves room for values that are rarer.
constexpr double kMostBelow = 0x1p-36, kMostAbove = 0x1p20;
/// A scale by the view is this far above the faint values: they have 24 bits, and what is brighter by 2^68
/// has room.
constexpr double kFaintBelow = 0x1p-28;

/// The largest radiance that light sources show, and the largest intensity of those that can't be seen.
struct Brightest {
  double radiance = 0, intensity = 0;
};

Brightest brightest_light(const LightTable& lights) {
  Brightest most;
  for (int32_t i = 0; i < lights.count(); ++i) {
    const auto light = static_cast<size_t>(i);
    const float* r = &lights.records[light * kLightFloats];
    const double radiance =
        std::max({double{r[kLightRadiance]}, double{r[kLightRadiance + 1]}, double{r[kLightRadiance + 2]}});
    const int32_t number = lights.pattern_of.empty() ? -1 : lights.pattern_of[light];
    const EmitterPattern* pattern = number < 0 ? nullptr : &lights.patterns[static_cast<size_t>(number)];
    const double times = pattern ? std::max(1.0, double{pattern->brightest}) : 1;
    if (is_at_a_point(lights.type[light])) {
      most.intensity = std::max(most.intensity, radiance);
    } else if (pattern && pattern->unseen) {
      // No nearer than its own size does it look brighter than its radiance.
      most.intensity = std::max(most.intensity, radiance * times * double{r[kLightArea]});
    } else {
      most.radiance = std::max(most.radiance, radiance * times);
    }
  }
  for (const EnvironmentMap& map : lights.environments)
    most.radiance = std::max(most.radiance, double{map.brightest});
  return most;
}

/// That the lights' power is spread over: of all surfaces, at least of the cube in the scene's bounding
/// sphere.
double lit_area(const RenderScene& scene) {
  const double radius = scene.bounds_radius;
  return std::max(double{scene.surface_area}, 8 * radius * radius);
}

double scale_of_lights(const RenderScene& scene, double imaging_ratio) {
  const Brightest most = brightest_light(scene.lights);
  const double spread = scene.lights.total_power / (M_PI * lit_area(scene));
  const double lamps = std::max(most.radiance / kTinyLampRoom, std::min(most.radiance, spread * kFaintRoom));
  return std::max(lamps, most.intensity * kPointLightRoom) * imaging_ratio;
}

}  // namespace

int RadianceScale::quantum_exponent() const {
  const int exponent = scale > 0 && std::isfinite(scale) ? std::ilogb(scale) + 1 : 0;
  return exponent - kQuantumBitsBelowScale;
}

RadianceScale radiance_scale(const RenderScene& scene, double imaging_ratio, const VisibleRange& seen) {
  const double by_lights = scale_of_lights(scene, imaging_ratio);
  const double faint = double{seen.faint}, bright = double{seen.bright};
  const bool holds = by_lights > 0 && std::isfinite(by_lights) && faint >= by_lights * kMostBelow &&
                     bright <= by_lights * kMostAbove;
  if (!(bright > 0) || holds) return {by_lights, false};
  // The bright parts come first where one scale can't hold both.
  return {std::max(faint / kFaintBelow, bright / kMostAbove), true};
}

float tiny_contribution(const RenderScene& scene) {
  if (!(scene.surface_area > 0)) return 0;
  return static_cast<float>(0.05 * scene.lights.total_power / (M_PI * lit_area(scene)));
}

}  // namespace lightmill
