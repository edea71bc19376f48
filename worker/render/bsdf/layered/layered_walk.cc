#include "worker/render/bsdf/layered/layered_walk.h"

#include <cmath>
#include <cstdint>

#include "worker/render/math/exp.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {
namespace {

constexpr int kStrata = 48;  // stratification of two-dimensional integrals
constexpr int kWalks = 4096;

/// Uniforms in [0, 1) by counting (SplitMix64, Steele et al. 2014).
class Counter {
 public:
  float operator()() {
    uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<float>((z ^ (z >> 31)) >> 40) * 0x1p-24f;
  }

 private:
  uint64_t state_ = 1;
};

/// Points of six dimensions that fill the cube evenly: multiples of the powers of 1/x, x^7 = x + 1 (Roberts'
/// extension of the golden ratio). Afterwards independent uniforms.
class WalkNumbers {
 public:
  void start(int walk) {
    walk_ = walk;
    used_ = 0;
  }
  float operator()() {
    constexpr double kSteps[] = {0.89932, 0.80877645, 0.72734887, 0.65411939, 0.58826265, 0.52903636};
    if (used_ >= 6) return random_();
    const double x = 0.5 + kSteps[used_++] * walk_;
    return std::min(static_cast<float>(x - std::floor(x)), 0x1.fffffep-1f);
  }

 private:
  Counter random_;
  int walk_ = 0, used_ = 0;
};

float loss(const CoatDescription& coat, float cosine) {
  return exp_negative(-coat.thickness / std::max(std::fabs(cosine), 1e-6f));
}

float stratum(int i) { return (static_cast<float>(i) + 0.5f) / kStrata; }

}  // namespace

double coat_entering(const CoatDescription& coat, float cosine) {
  double sum = 0;
  for (int i = 0; i < kStrata * kStrata; ++i) {
    const CoatCrossing x =
        cross_coat(coat.alpha, coat.eta, coat_direction(cosine), stratum(i % kStrata), stratum(i / kStrata));
    sum += double{x.transmittance} * loss(coat, x.transmitted.z);
  }
  return sum / (kStrata * kStrata);
}

double coat_internal_return(const CoatDescription& coat) {
  Counter random;
  constexpr int kSamples = 128;
  double sum = 0;
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const int column = i % kSamples, row = i / kSamples;
    const float u = (static_cast<float>(column) + random()) / kSamples;
    const float v = (static_cast<float>(row) + random()) / kSamples;
    const Vec3<float> w = square_to_cosine_hemisphere(std::min(u, 1.0f), std::min(v, 1.0f));
    const float fu = random(), fv = random();
    const CoatCrossing x = cross_coat(coat.alpha, 1 / coat.eta, w, fu, fv);
    sum += double{x.reflectance} * loss(coat, w.z) * loss(coat, x.reflected.z);
  }
  return sum / (kSamples * kSamples);
}

std::vector<double> coated_conductor_orders(const CoatDescription& coat, float metal_alpha, float cosine,
                                            int encounters) {
  std::vector<double> orders(static_cast<size_t>(encounters), 0.0);
  WalkNumbers random;
  // Named one by one: the order in which arguments are evaluated is the compiler's.
  const auto crossing = [&](float eta, const Vec3<float>& from) {
    const float u = random(), v = random();
    return cross_coat(coat.alpha, eta, from, u, v);
  };
  for (int i = 0; i < kWalks; ++i) {
    random.start(i);
    CoatCrossing x = crossing(coat.eta, coat_direction(cosine));
    float weight = x.transmittance / kWalks;
    Vec3<float> down = x.transmitted;
    for (double& order : orders) {
      if (weight <= 0) break;
      const Vec3<float> from = -down;
      const float u = random(), v = random();
      const Vec3<float> m = coat_facet(metal_alpha, from, u, v);
      const Vec3<float> up = m * (2 * dot(from, m)) - from;
      if (up.z <= 0) break;
      weight *= loss(coat, down.z) * coat_unmasked(metal_alpha, from, up) * loss(coat, up.z);
      // What gets out is counted, what does not goes on: no choice, less noise.
      x = crossing(1 / coat.eta, up);
      order += double{weight} * x.transmittance;
      weight *= x.reflectance;
      down = -x.reflected;
    }
  }
  return orders;
}

}  // namespace lightmill
