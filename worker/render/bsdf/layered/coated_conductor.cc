#include "worker/render/bsdf/layered/coated_conductor.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/layered/layered_walk.h"

namespace lightmill {
namespace {

/// The lobe of the first order over a metal that reflects everything, from outside cosine `cosine`.
std::vector<LobeSample> first_order(const BsdfParams<float>& params, float cosine) {
  constexpr int kSide = 16;
  const CoatedConductor<float, true, false, false> coat{params, true};
  const Vec3<float> wo{std::sqrt(max(1 - cosine * cosine, 0.0f)), 0, cosine};
  const auto o = coat.side(wo);
  const Ggx<float> ggx{params.p[6]};
  std::vector<LobeSample> samples;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int row = i / kSide, column = i % kSide;
    const float u = (static_cast<float>(column) + 0.5f) / kSide;
    const float v = (static_cast<float>(row) + 0.5f) / kSide;
    const Vec3<float> m = ggx.sample_visible(o.inside, u, v);
    const Vec3<float> inner = m * (2.0f * dot(o.inside, m)) - o.inside;
    const Vec3<float> flat{inner.x * params.p[3], inner.y * params.p[3], 0};
    const float out2 = 1 - dot(flat, flat);
    if (inner.z <= 0 || out2 <= 0) continue;
    const auto s = coat.side({flat.x, flat.y, std::sqrt(out2)});
    const float unmasked = ggx.g(o.inside, inner) / ggx.g1(o.inside);
    samples.push_back({o.to_metal * s.to_metal * unmasked / (kSide * kSide), s.cosine});
  }
  return samples;
}

}  // namespace

// By how much a facet's slope tilts what it refracts: s (1 - cos / (eta cos')) in the plane of incidence and
// s (cos' - cos / eta) across it. Both are 1 - 1/eta at normal incidence and grow away from it; one number
// stands for all directions, the geometric mean at 30 degrees.
//
// GGX slopes have no variance, so that squares of widths do not add. The density of the sum of two equal ones
// of width a has its peak at 1 / (3 pi a^2) (by Hankel transform: int x^3 K_1(x)^2 dx = 2/3), as one of width
// sqrt(3) a. With the metal's as a third, the peak lies within 4 % of that of the width below.
float coated_conductor_alpha(float eta, float coat_alpha, float metal_alpha) {
  constexpr float kCosine = 0.8660254f;
  const float cos_t = std::sqrt(std::max(1 - (1 - kCosine * kCosine) / (eta * eta), 0.01f));
  const float tilt = std::sqrt(std::fabs((1 - kCosine / (eta * cos_t)) * (cos_t - kCosine / eta)));
  const float a = coat_alpha <= kSmoothAlpha ? 0.0f : 0.5f * tilt * coat_alpha;
  const float m = metal_alpha <= kSmoothAlpha ? 0.0f : metal_alpha;
  const float cross = a > 0 ? 1.6f * m * a * a / (a + 0.05f * m) : 0.0f;
  return std::max(std::sqrt(m * m + 3 * a * a + cross), kSmoothAlpha);
}

std::array<CosineRow, kReflectanceNodes> coated_conductor_rows(float eta, float thickness, float coat_alpha,
                                                               float metal_alpha, int max_depth) {
  BsdfParams<float> params;
  params.p[3] = eta;
  params.p[5] = thickness;
  params.p[6] = coated_conductor_alpha(eta, coat_alpha, metal_alpha);
  params.p[7] = coat_alpha <= kSmoothAlpha ? 0.0f : coat_alpha;
  const int encounters = (max_depth + 1) / 2;  // every other interaction is with the metal
  std::array<std::vector<double>, kCosineNodes> orders;
  std::array<std::vector<LobeSample>, kCosineNodes> lobe;
  for (int i = 0; i < kCosineNodes; ++i) {
    const auto n = static_cast<size_t>(i);
    orders[n] =
        coated_conductor_orders({eta, thickness, coat_alpha}, metal_alpha, node_cosine(i), encounters);
    lobe[n] = first_order(params, node_cosine(i));
  }
  std::array<CosineRow, kReflectanceNodes> rows;
  for (size_t r = 0; r < kReflectanceNodes; ++r) {
    const double rho = static_cast<double>(r) / (kReflectanceNodes - 1);
    std::array<double, kCosineNodes> albedo;  // over rho, which the lobe brings by its own Fresnel term
    for (size_t i = 0; i < kCosineNodes; ++i) {
      double power = 1;
      albedo[i] = 0;
      for (const double order : orders[i]) {
        albedo[i] += order * power;
        power *= rho;
      }
    }
    rows[r] = balance(lobe, albedo);
  }
  return rows;
}

void coated_conductor_fresnel(const float eta[3], const float k[3], float coat_eta, float f0[3],
                              float* rise) {
  // Directions in the coat lie within the critical cone, so a facet that turns one into another is met at
  // a cosine from the cone's to 1; the rise is matched at the cone's edge.
  const float sine = std::min(1 / coat_eta, 0.9f);
  const float c = std::sqrt(1 - sine * sine);
  float gained = 0, room = 0;
  for (int i = 0; i < 3; ++i) {
    f0[i] = fresnel_conductor(1.0f, eta[i], k[i]);
    gained += fresnel_conductor(c, eta[i], k[i]) - f0[i];
    room += (1 - f0[i]) * (1 - f0[i]) * (1 - f0[i]);
  }
  *rise = room > 1e-4f ? gained / (room * (1 - c) * (1 - c)) : 0.0f;
}

}  // namespace lightmill
