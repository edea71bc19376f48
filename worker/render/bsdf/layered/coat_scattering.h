#pragma once
// Coats with a medium that scatters (pbrt-v4 §14.3: albedo and g of a layered material), as lobes in closed
// form over tables.
//
// What the medium has scattered leaves the coat as
//   f_s(wo, wi) = f_1(wo, wi) + S(cos wo, cos wi)
// f_1 is what it scattered once and no more, with wo', wi' the directions refracted into the coat:
//   f_1 = (1 - F(wo)) (1 - F(wi)) / eta^2 a p(wo', wi') (1 - exp(-t (1 / mo' + 1 / mi'))) / (mo' + mi')
// (Chandrasekhar 1960, §47), for which the shape of the phase function p matters. S is the rest, the same all
// round: the exact answer averaged over azimuth (coat_transfer.h) less the average of f_1. So the albedo is
// right in every direction, and what is left out is only how light scattered more than once varies with
// azimuth. Reciprocal by form.
//
// A block of rows (albedo_table.h) holds all that a lobe needs; its first row:
//   0-2 single-scattering albedo, 3 g, 4 mean share of f_s in what enters (for choosing lobes)
//   5, 6 anisotropy of the base's and of the coat's lobe (anisotropic_lobe), 1 if they are round
// then S per channel, kCosineNodes rows for the cosines of wo, each over those of wi.
#include <array>
#include <vector>

#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/layered/coat_crossing.h"
#include "worker/render/bsdf/tables/albedo_table.h"
#include "worker/render/math/exp.h"

namespace lightmill {

/// What is in a coat, besides its optical thickness (CoatDescription).
struct CoatMedium {
  std::array<float, 3> albedo;
  float g;
};

inline constexpr int kBaseAnisotropy = 5, kCoatAnisotropy = 6;        // places in the first row
inline constexpr int kScatteringTable = kCosineNodes * kCosineNodes;  // floats of S, one channel
inline constexpr int kScatteringBlock = kCosineNodes + 3 * kScatteringTable;

/// Over a Lambertian base, whose own light is told apart: it forgets where light came from.
struct ScatteringCoat {
  std::vector<float> block;
  std::array<CosineRow, 3> entering;  // share of what enters at a cosine that gets to the base
  std::array<double, 3> returned;     // share of what leaves the base that comes back to it
  float entering_mean;                // of diffuse light from outside that gets to the base, largest channel
};
ScatteringCoat scattering_coat(const CoatDescription& coat, const CoatMedium& medium);

/// Over a metal of roughness `metal_alpha` that reflects `reflectance` in each channel: the block.
std::vector<float> scattering_coat_over_metal(const CoatDescription& coat, const CoatMedium& medium,
                                              float metal_alpha, const std::array<float, 3>& reflectance);

/// The coat's or the metal's lobe, of mean roughness `alpha`: along the tangent `ratio` times as wide, across
/// it that much narrower.
template <class F>
inline AnisotropicGgx<F> anisotropic_lobe(F alpha, F ratio) {
  return {max(alpha * ratio, splat<F>(kSmoothAlpha)), max(alpha / ratio, splat<F>(kSmoothAlpha))};
}

/// A direction outside and the one refracted from it, both on the upper side.
template <class F>
struct CoatSide {
  Vec3<F> inside;
  F cosine, transmittance;  // 1 - F
};

template <class F>
struct CoatScattering {
  const float* tables;
  IntOf<F> block;

  F constant(int i) const { return gather(tables + i, block); }

  /// f_1 over the albedo. All arguments are symmetric in `o` and `i`.
  F once(const CoatSide<F>& o, const CoatSide<F>& i, F eta, F thickness, F g) const {
    // Light goes on along -i.inside and leaves along o.inside.
    const F c = -dot(o.inside, i.inside);
    const F d = max(1.0f + g * g - 2.0f * g * c, splat<F>(1e-6f));
    const F phase = (1.0f - g * g) * (0.25f * kInvPi) / (d * sqrt(d));
    const F mo = o.inside.z, mi = i.inside.z, x = thickness * (1.0f / mo + 1.0f / mi);
    // 1 - exp(-x), which cancels for a thin coat.
    const F scattered =
        select(MaskOf<F>(x < 0.01f), x * (1.0f - x * (0.5f - x * (1.0f / 6))), 1.0f - exp_negative(-x));
    return o.transmittance * i.transmittance * phase * scattered / ((mo + mi) * eta * eta);
  }

  Vec3<F> f(const CoatSide<F>& o, const CoatSide<F>& i, F eta, F thickness) const {
    const F first = once(o, i, eta, thickness, constant(3));
    const CosinePlace<F> po(o.cosine), pi(i.cosine);
    const auto channel = [&](int c) {
      const IntOf<F> row = block + (kCosineNodes + c * kScatteringTable) + po.node * kCosineNodes;
      const F a = pi.in(tables, row), b = pi.in(tables, row + kCosineNodes);
      return constant(c) * first + a + (b - a) * po.t;
    };
    return {channel(0), channel(1), channel(2)};
  }
};

}  // namespace lightmill
