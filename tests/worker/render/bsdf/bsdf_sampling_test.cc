// chi^2 of every BSDF's sampler against the integral of its density over a grid of directions, including the
// probability that no (non-delta) direction comes; and the weight's agreement with f |cos| / pdf.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

constexpr int kThetaBins = 23, kPhiBins = 24;
constexpr int kSamples = 100000;

Vec3<float> direction(double theta, double phi) {
  return {static_cast<float>(std::sin(theta) * std::cos(phi)),
          static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))};
}

/// Integral of the density over a rectangle of angles: midpoints on a 4x4 grid, refined where halving the
/// step changes the value or where the support ends.
struct Integrator2 {
  const BsdfCase& bsdf;
  Vec3<float> wo;

  double density(double theta, double phi) const {
    return double{bsdf.eval(wo, direction(theta, phi)).pdf} * std::sin(theta);
  }
  double grid(double t0, double t1, double p0, double p1, int n) const {
    double sum = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j)
        sum += density(t0 + (t1 - t0) * (i + 0.5) / n, p0 + (p1 - p0) * (j + 0.5) / n);
    }
    return sum * (t1 - t0) * (p1 - p0) / (n * n);
  }
  /// True if the edge of the support, where rough glass has a step, crosses the rectangle.
  bool crosses_edge(double t0, double t1, double p0, double p1) const {
    int positive = 0;
    for (int i = 0; i <= 4; ++i) {
      for (int j = 0; j <= 4; ++j)
        positive += bsdf.eval(wo, direction(t0 + (t1 - t0) * i / 4, p0 + (p1 - p0) * j / 4)).pdf > 0;
    }
    return positive > 0 && positive < 25;
  }
  double integral(double t0, double t1, double p0, double p1, int depth = 0) const {
    const double coarse = grid(t0, t1, p0, p1, 4), fine = grid(t0, t1, p0, p1, 8);
    if (depth >= 5 || (std::fabs(fine - coarse) < 2e-7 + 1e-4 * fine && !crosses_edge(t0, t1, p0, p1))) {
      return depth >= 5 ? fine : fine + (fine - coarse) / 3;
    }
    const double tm = 0.5 * (t0 + t1), pm = 0.5 * (p0 + p1);
    return integral(t0, tm, p0, pm, depth + 1) + integral(tm, t1, p0, pm, depth + 1) +
           integral(t0, tm, pm, p1, depth + 1) + integral(tm, t1, pm, p1, depth + 1);
  }
};

TEST(BsdfSampling, DirectionsFollowTheDensity) {
  const auto cases = all_bsdfs();
  const auto outgoing = outgoing_directions();
  const auto family = static_cast<int64_t>(cases.size() * outgoing.size());
  uint64_t seed = 0;
  for (const BsdfCase& bsdf : cases) {
    if (is_pure_delta(bsdf.kind)) continue;
    for (const Vec3<float>& wo : outgoing) {
      SCOPED_TRACE(bsdf.name + " cos " + std::to_string(wo.z));
      constexpr size_t kNone = kThetaBins * kPhiBins;
      std::vector<double> observed(kNone + 1), expected(kNone + 1);
      Random random(++seed);
      for (int i = 0; i < kSamples; ++i) {
        const BsdfSample<float> s = bsdf.sample(wo, random);
        size_t bin = kNone;
        if (s.valid && !s.delta) {
          const double theta = std::atan2(std::hypot(double{s.wi.x}, double{s.wi.y}), double{s.wi.z});
          const double phi = std::atan2(s.wi.y, s.wi.x) + M_PI;
          const auto t = std::min<size_t>(static_cast<size_t>(theta / M_PI * kThetaBins), kThetaBins - 1);
          const auto p = std::min<size_t>(static_cast<size_t>(phi / (2 * M_PI) * kPhiBins), kPhiBins - 1);
          bin = t * kPhiBins + p;
        }
        ++observed[bin];
      }
      const Integrator2 integrator{bsdf, wo};
      double total = 0;
      for (size_t t = 0; t < kThetaBins; ++t) {
        for (size_t p = 0; p < kPhiBins; ++p) {
          const double v = integrator.integral(
              M_PI * double(t) / kThetaBins, M_PI * double(t + 1) / kThetaBins,
              2 * M_PI * double(p) / kPhiBins - M_PI, 2 * M_PI * double(p + 1) / kPhiBins - M_PI);
          expected[t * kPhiBins + p] = v * kSamples;
          total += v;
        }
      }
      EXPECT_LE(total, bsdf.kind == kToon ? 1 + 1e-3 : 1 + 1e-4);  // a step is integrated less well
      expected[kNone] = std::max(0.0, 1 - total) * kSamples;
      EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), family));
    }
  }
}

TEST(BsdfSampling, WeightAndDensitiesAreThoseOfEvaluation) {
  Random random(7);
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (is_pure_delta(bsdf.kind)) continue;
    // The half vector's rounding is amplified by the lobe's slope, 1 / alpha^2.
    const float tolerance = bsdf.alpha > 0 ? 2e-5f + 2e-6f / (bsdf.alpha * bsdf.alpha) : 2e-5f;
    for (const Mode mode : {Mode::kRadiance, Mode::kImportance}) {
      for (const Vec3<float>& wo : outgoing_directions()) {
        SCOPED_TRACE(bsdf.name + " cos " + std::to_string(wo.z));
        for (int i = 0; i < 500; ++i) {
          const BsdfSample<float> s = bsdf.sample(wo, random, mode);
          if (!s.valid || s.delta) continue;
          if (bsdf.kind == kHair && abs(s.wi.z) < kLeastHairCosine) continue;  // where f is held finite
          ASSERT_NEAR(dot(s.wi, s.wi), 1, 1e-5f);
          const BsdfEval<float> e = bsdf.eval(wo, s.wi, mode);
          ASSERT_GT(s.pdf, 0);
          ASSERT_NEAR(s.pdf / e.pdf, 1, tolerance);
          // None where glass reflects all on the other side, and out of a toon's cone.
          const bool may_be_one_way = bsdf.kind == kRoughGlass || bsdf.kind == kToon;
          if (may_be_one_way && s.pdf_reverse == 0) {
            ASSERT_EQ(e.pdf_reverse, 0);
          } else {
            ASSERT_NEAR(s.pdf_reverse / e.pdf_reverse, 1, tolerance);
          }
          const float expected = e.f.y * abs(s.wi.z) / e.pdf;
          ASSERT_NEAR(s.weight.y, expected, tolerance * std::max(expected, 0.1f));
          ASSERT_GE(s.weight.y, 0);
        }
      }
    }
  }
}

TEST(BsdfSampling, DeltaLobesAreChosenByTheFresnelReflectance) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (bsdf.kind != kSmoothDielectric) continue;
    for (const Vec3<float>& wo : outgoing_directions()) {
      const float eta = wo.z > 0 ? bsdf.params.p[0] : 1 / bsdf.params.p[0];
      float cos_t;
      const float f = fresnel_dielectric(abs(wo.z), eta, &cos_t);
      Random random(3);
      double counts[2] = {0, 0};
      for (int i = 0; i < 20000; ++i) {
        const BsdfSample<float> s = bsdf.sample(wo, random, Mode::kImportance);
        ASSERT_TRUE(s.valid && s.delta);
        ASSERT_EQ(s.weight.x, 1.0f);  // lossless, path by path
        const bool reflected = s.wi.z * wo.z > 0;
        ++counts[reflected ? 0 : 1];
        // Snell's law.
        const double sine_o = std::hypot(wo.x, wo.y), sine_i = std::hypot(s.wi.x, s.wi.y);
        ASSERT_NEAR(sine_i * (reflected ? 1 : eta), sine_o, 1e-5);
        ASSERT_LE(s.wi.x * wo.x + s.wi.y * wo.y, 1e-6);
      }
      const double expected[2] = {20000.0 * f, 20000.0 * (1 - f)};
      EXPECT_TRUE(chi_square_passes(chi_square(counts, expected), 8)) << "cos " << wo.z;
    }
  }
}

// Against the sum of the series of internal reflections, in double; what is not reflected goes straight on.
TEST(BsdfSampling, ThinSheetsReflectTheSumOverAllBounces) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (bsdf.kind != kThinDielectric) continue;
    for (const Vec3<float>& wo : outgoing_directions()) {
      float cos_t;
      const double face = fresnel_dielectric(abs(wo.z), bsdf.params.p[0], &cos_t);
      double reflected = face;
      for (double inside = (1 - face) * face; inside > 1e-12; inside *= face * face)
        reflected += inside * (1 - face);
      Random random(4);
      double counts[2] = {0, 0};
      for (int i = 0; i < 20000; ++i) {
        const Mode mode = i % 2 ? Mode::kRadiance : Mode::kImportance;
        const BsdfSample<float> s = bsdf.sample(wo, random, mode);
        ASSERT_TRUE(s.valid && s.delta);
        ASSERT_EQ(s.weight.x, 1.0f);
        ASSERT_EQ(s.roulette_scale, 1.0f);
        ASSERT_EQ(s.wi.x, -wo.x);
        ASSERT_EQ(s.wi.y, -wo.y);
        ASSERT_EQ(abs(s.wi.z), abs(wo.z));
        ++counts[s.wi.z * wo.z > 0 ? 0 : 1];
      }
      const double expected[2] = {20000 * reflected, 20000 * (1 - reflected)};
      EXPECT_TRUE(chi_square_passes(chi_square(counts, expected), 32)) << bsdf.name << " cos " << wo.z;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
