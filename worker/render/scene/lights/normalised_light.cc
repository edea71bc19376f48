#include "worker/render/scene/lights/normalised_light.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

namespace lightmill {
namespace {

/// Exponents of lights that stay as they are. Squares of floats hold those up to kSquares.
constexpr int kPlain = 40, kSquares = 50;

/// The exponents of the faintest and the brightest.
class Exponents {
 public:
  void add(const Rgb& c, int more = 0) {
    const float size = std::max({c.r, c.g, c.b});
    if (!(size > 0)) return;
    const int exponent = std::ilogb(size) + more;
    least = any_ ? std::min(least, exponent) : exponent;
    most = any_ ? std::max(most, exponent) : exponent;
    any_ = true;
  }
  int least = 0, most = 0;

 private:
  bool any_ = false;
};

}  // namespace

int light_exponent(const SceneDescription& scene, int scale_exponent) {
  if (scene.film.most > 0) return 0;
  Exponents e;
  for (const AreaLightDescription& light : scene.area_lights) e.add(light.radiance);
  for (const MediumDescription& medium : scene.media) e.add(brightest(medium));
  for (const LightDescription& light : scene.lights) {
    std::visit(
        [&](const auto& kind) {
          using Kind = std::decay_t<decltype(kind)>;
          if constexpr (std::is_same_v<Kind, InfiniteLight> || std::is_same_v<Kind, AreaLamp>) {
            e.add(kind.radiance);
          } else if constexpr (std::is_same_v<Kind, DistantLight>) {
            e.add(kind.irradiance);
          } else {
            e.add(kind.intensity, 2 * scale_exponent);
          }
        },
        light.kind);
  }
  if (e.least >= -kPlain && e.most <= kPlain) return 0;
  // In the middle; if that is not enough for all, what is brightest counts.
  return std::max((e.least + e.most) / 2, e.most - kSquares);
}

}  // namespace lightmill
