#include "worker/render/scene/lights/normalised_light.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

namespace lightmill {
namespace {

/// Exponents of lights that stay as they are. Squares of floats hold those up to kSquares.
constexpr int kPlain = 40, kSquares = 50;

/// Calls visit(colour) for what each light is made of.
template <class Visit>
void for_each_light(SceneDescription* scene, Visit&& visit) {
  for (AreaLightDescription& light : scene->area_lights) visit(light.radiance);
  for (MediumDescription& medium : scene->media) visit(medium.emission);
  for (LightDescription& light : scene->lights) {
    std::visit(
        [&](auto& kind) {
          using Kind = std::decay_t<decltype(kind)>;
          if constexpr (std::is_same_v<Kind, InfiniteLight>) {
            visit(kind.radiance);
          } else if constexpr (std::is_same_v<Kind, DistantLight>) {
            visit(kind.irradiance);
          } else {
            visit(kind.intensity);
          }
        },
        light.kind);
  }
}

}  // namespace

int normalise_light(SceneDescription* scene) {
  if (scene->film.most > 0) return 0;
  int least = 0, most = 0;
  bool any = false;
  for_each_light(scene, [&](const Rgb& c) {
    const float size = std::max({c.r, c.g, c.b});
    if (!(size > 0)) return;
    const int exponent = std::ilogb(size);
    least = any ? std::min(least, exponent) : exponent;
    most = any ? std::max(most, exponent) : exponent;
    any = true;
  });
  if (least >= -kPlain && most <= kPlain) return 0;
  // In the middle; if that is not enough for all, what is brightest counts.
  const int k = std::max((least + most) / 2, most - kSquares);
  for_each_light(scene, [&](Rgb& c) {
    for (float* channel : {&c.r, &c.g, &c.b}) *channel = std::ldexp(*channel, -k);
  });
  return k;
}

}  // namespace lightmill
