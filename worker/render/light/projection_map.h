#pragma once
// The intensity of a projection light: an image projected through a window in front of it. Constant within a
// texel, sampled in proportion to the texels' power.
#include <cstdint>
#include <vector>

#include "worker/render/light/alias_table.h"
#include "worker/render/light/light_image.h"
#include "worker/render/math/vec.h"

namespace lightmill {

struct ProjectionMap {
  int32_t width = 0, height = 0;
  std::vector<float> rgb;         // 3 per texel, row-major from the top; intensity
  std::vector<float> density;     // per texel: of sampling, per unit area of the window at distance 1
  std::vector<float> alias_keep;  // alias method over texels
  std::vector<int32_t> alias;
  float to_light[9];             // rotation from world to the light's space, row-major: +z forward, +y up
  float half_x = 1, half_y = 1;  // half the window's size at distance 1
  double power = 0;              // W, mean over the channels
  float brightest = 0;           // any channel of any texel

  /// Scaled by `scale` per channel. `fov_degrees` is the full angle of the shorter side. Throws
  /// Error(kBadScene) if the image holds no light.
  ProjectionMap(LightImage image, const Rgb& scale, const Transform& light_to_world, double fov_degrees);

  /// The texel in world direction `w`, and whether `w` is inside the window. `z`: the cosine to the axis. Any
  /// w gives a valid texel.
  template <class F>
  IntOf<F> texel(const Vec3<F>& w, MaskOf<F>* inside, F* z) const {
    const float* m = to_light;
    *z = w.x * m[6] + w.y * m[7] + w.z * m[8];
    const MaskOf<F> ahead = MaskOf<F>(*z > 0.0f);
    const F inv = 1.0f / select(ahead, *z, splat<F>(1.0f));
    const F x = (w.x * m[0] + w.y * m[1] + w.z * m[2]) * inv * (1 / half_x);
    const F y = (w.x * m[3] + w.y * m[4] + w.z * m[5]) * inv * (1 / half_y);
    *inside = mask_and(ahead, mask_and(MaskOf<F>(abs(x) <= 1.0f), MaskOf<F>(abs(y) <= 1.0f)));
    const auto place = [](F at, int32_t count) {
      const IntOf<F> i = to_int(clamp(at * 0.5f + 0.5f, 0.0f, 1.0f) * static_cast<float>(count));
      const IntOf<F> last = splat_int<F>(count - 1);
      return select(MaskOf<F>(i > last), last, i);
    };
    return place(-y, height) * width + place(x, width);
  }
  template <class F>
  Vec3<F> radiance(IntOf<F> texel) const {
    return gather3<F>(rgb.data(), texel);
  }
  /// Density of sample() per unit solid angle.
  template <class F>
  F pdf(IntOf<F> texel, const Vec3<F>& w) const {
    const float* m = to_light;
    const F z = w.x * m[6] + w.y * m[7] + w.z * m[8];
    // In lanes of other lights w may be any direction.
    const MaskOf<F> ahead = MaskOf<F>(z > 0.0f);
    return select(ahead, gather(density.data(), texel) / select(ahead, z * z * z, splat<F>(1.0f)), F{});
  }
  template <class F>
  Vec3<F> towards(const Vec3<F>& w) const {
    MaskOf<F> inside;
    F z;
    const IntOf<F> at = texel<F>(w, &inside, &z);
    return select(inside, radiance<F>(at), Vec3<F>{});
  }
  template <class F>
  F pdf_towards(const Vec3<F>& w) const {
    MaskOf<F> inside;
    F z;
    const IntOf<F> at = texel<F>(w, &inside, &z);
    return select(inside, gather(density.data(), at) / select(inside, z * z * z, splat<F>(1.0f)), F{});
  }
  /// Draws a world direction: a texel by `pick`, a place in it by (u, v).
  template <class F>
  Vec3<F> sample(F pick, F u, F v, IntOf<F>* chosen) const {
    *chosen = select_alias(alias_keep, alias, pick);
    int32_t xs[8], ys[8];
    for (int l = 0; l < kWidth<F>; ++l) {
      xs[l] = lane(*chosen, l) % width;
      ys[l] = lane(*chosen, l) / width;
    }
    const F x = ((to_float(load_int<F>(xs)) + u) * (2.0f / static_cast<float>(width)) - 1.0f) * half_x;
    const F y = (1.0f - (to_float(load_int<F>(ys)) + v) * (2.0f / static_cast<float>(height))) * half_y;
    const float* m = to_light;
    return normalize(
        Vec3<F>{x * m[0] + y * m[3] + m[6], x * m[1] + y * m[4] + m[7], x * m[2] + y * m[5] + m[8]});
  }
};

}  // namespace lightmill
