#pragma once
// A light of all directions as a square equal-area image: the radiance of an environment, or the intensity of
// a goniometric light. Constant within a texel, sampled in proportion.
#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/guiding/binned_density.h"
#include "worker/render/light/alias_table.h"
#include "worker/render/light/light_image.h"
#include "worker/render/math/equal_area.h"

namespace lightmill {

/// Reads a square equal-area image, or a lat-long one of any resolution (InfiniteLight), which is resampled
/// to about as many texels, at least `least_side` a side. Throws as read_light_image.
LightImage read_environment(const std::string& path, bool lat_long, int least_side = 0);

struct EnvironmentMap {
  int32_t side = 0;               // texels per row and column
  std::vector<float> rgb;         // 3 per texel, row-major from the top; radiance
  std::vector<float> density;     // per texel: sampling density on the unit square, 4 pi x that per steradian
  std::vector<float> alias_keep;  // alias method over texels
  std::vector<int32_t> alias;
  float to_light[9];         // rotation from world to the light's space, row-major
  double mean_radiance = 0;  // mean over the sphere and the channels
  float brightest = 0;       // any channel of any texel
  BinnedDensity bins;        // with tables where a next-event guide draws by them (next_event_guide.h)

  /// `image` must be square. It is scaled by `scale` per channel. Throws Error(kBadScene) if it is not square
  /// or holds no light.
  EnvironmentMap(LightImage image, const Rgb& scale, const Transform& light_to_world);
  /// The same from a file, as read_environment gives it.
  EnvironmentMap(const std::string& path, const Rgb& scale, const Transform& light_to_world,
                 bool lat_long = false);

  /// Makes sample() draw the light that a plane with unit normal `n` gets on its front, by cosine. Returns
  /// the irradiance there, mean over the channels. Throws Error(kBadScene) if it is 0.
  double face(const Vec3f& n);

  /// Weights of the texels, in proportion to their light.
  std::vector<double> weights() const;

  template <class F>
  Vec3<F> rotate_to_light(const Vec3<F>& w) const {
    const float* m = to_light;
    return {w.x * m[0] + w.y * m[1] + w.z * m[2], w.x * m[3] + w.y * m[4] + w.z * m[5],
            w.x * m[6] + w.y * m[7] + w.z * m[8]};
  }
  template <class F>
  Vec3<F> rotate_to_world(const Vec3<F>& w) const {
    const float* m = to_light;
    return {w.x * m[0] + w.y * m[3] + w.z * m[6], w.x * m[1] + w.y * m[4] + w.z * m[7],
            w.x * m[2] + w.y * m[5] + w.z * m[8]};
  }
  /// The texel in world direction `w`.
  template <class F>
  IntOf<F> texel(const Vec3<F>& w) const {
    IntOf<F> x, y;
    find_texel(w, &x, &y);
    return y * side + x;
  }
  /// Its column and row.
  template <class F>
  void find_texel(const Vec3<F>& w, IntOf<F>* x, IntOf<F>* y) const {
    F s, t;
    equal_area_sphere_to_square(rotate_to_light(w), &s, &t);
    const IntOf<F> last = splat_int<F>(side - 1);
    const IntOf<F> column = to_int(s * static_cast<float>(side)), row = to_int(t * static_cast<float>(side));
    *x = select(MaskOf<F>(column > last), last, column);
    *y = select(MaskOf<F>(row > last), last, row);
  }
  template <class F>
  Vec3<F> radiance(IntOf<F> texel) const {
    return gather3<F>(rgb.data(), texel);
  }
  /// Density of sample() per unit solid angle.
  template <class F>
  F pdf(IntOf<F> texel) const {
    return gather(density.data(), texel) * (1 / (4 * kPi));
  }
  template <class F>
  F pdf(IntOf<F> texel, const Vec3<F>&) const {
    return pdf<F>(texel);
  }
  /// The light from world direction `w` (an environment), or into it (a light at a point).
  template <class F>
  Vec3<F> towards(const Vec3<F>& w) const {
    return radiance<F>(texel<F>(w));
  }
  template <class F>
  F pdf_towards(const Vec3<F>& w) const {
    return pdf<F>(texel<F>(w));
  }
  /// Draws a world direction: a texel by `pick`, a place in it by (u, v).
  template <class F>
  Vec3<F> sample(F pick, F u, F v, IntOf<F>* chosen) const {
    *chosen = select_alias(alias_keep, alias, pick);
    int32_t xs[8], ys[8];
    for (int l = 0; l < kWidth<F>; ++l) {
      xs[l] = lane(*chosen, l) % side;
      ys[l] = lane(*chosen, l) / side;
    }
    return in_texel(load_int<F>(xs), load_int<F>(ys), u, v);
  }
  /// The same by a table of `bins`: a bin by `pick`, the rest by (u, v).
  template <class F>
  Vec3<F> sample_by(IntOf<F> table, F pick, F u, F v, IntOf<F>* chosen, F* density_there) const {
    IntOf<F> x, y;
    bins.draw<F>(table, pick, &u, &v, &x, &y);
    *chosen = y * side + x;
    *density_there = bins.density<F>(table, x, y) * (1 / (4 * kPi));
    return in_texel(x, y, u, v);
  }
  /// Density of sample_by() per unit solid angle in world direction `w`.
  template <class F>
  F pdf_by(IntOf<F> table, const Vec3<F>& w) const {
    IntOf<F> x, y;
    find_texel(w, &x, &y);
    return bins.density<F>(table, x, y) * (1 / (4 * kPi));
  }

 private:
  template <class F>
  Vec3<F> in_texel(IntOf<F> x, IntOf<F> y, F u, F v) const {
    const float inv = 1.0f / static_cast<float>(side);
    return rotate_to_world(equal_area_square_to_sphere((to_float(x) + u) * inv, (to_float(y) + v) * inv));
  }
  void draw_by(const std::vector<double>& weights);  // one per texel
};

}  // namespace lightmill
