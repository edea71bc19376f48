// Fresnel reflectances against the complex form in double, and their limits.
#include "worker/render/bsdf/fresnel.h"

#include <gtest/gtest.h>

#include <complex>

#include "tests/support/statistics.h"

namespace lightmill::test {
namespace {

/// Reflectance of an interface to (complex) relative index `n`, from the amplitude coefficients.
double reference(double cos_i, std::complex<double> n) {
  const std::complex<double> sin_t = std::sqrt(1 - cos_i * cos_i) / n;
  std::complex<double> cos_t = std::sqrt(1.0 - sin_t * sin_t);
  if ((n * cos_t).imag() > 0) cos_t = -cos_t;  // n = eta - i k: the wave decays
  if ((n * cos_t).imag() == 0 && (n * cos_t).real() < 0) cos_t = -cos_t;
  const auto s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
  const auto p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
  return 0.5 * (std::norm(s) + std::norm(p));
}

TEST(Fresnel, DielectricMatchesTheAmplitudeForm) {
  for (const float eta : {1.01f, 1.33f, 1.5f, 2.4f, 1 / 1.33f, 1 / 2.4f}) {
    for (int i = 1; i <= 200; ++i) {
      const float c = static_cast<float>(i) / 200;
      float cos_t;
      const float f = fresnel_dielectric(c, eta, &cos_t);
      const double sin2_t = (1 - double{c} * c) / (double{eta} * eta);
      if (sin2_t > 1.0001) {
        EXPECT_EQ(f, 1.0f);
        EXPECT_EQ(cos_t, 0.0f);
      } else if (sin2_t < 0.9999) {
        EXPECT_NEAR(f, reference(c, eta), 2e-5) << eta << " " << c;
        EXPECT_NEAR(cos_t, std::sqrt(1 - sin2_t), 1e-4);
      }
      EXPECT_GE(f, 0);
      EXPECT_LE(f, 1);
    }
  }
}

TEST(Fresnel, DielectricLimits) {
  float cos_t;
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f, &cos_t), 0.04f, 1e-7f);
  EXPECT_EQ(fresnel_dielectric(0.0f, 1.5f, &cos_t), 1.0f);
  for (const float c : {0.01f, 0.1f, 0.5f, 1.0f})
    EXPECT_NEAR(fresnel_dielectric(c, 1.0f, &cos_t), 0.0f, 1e-6f) << c;
  EXPECT_EQ(fresnel_dielectric(0.5f, 1 / 1.5f, &cos_t), 1.0f);  // beyond the critical angle
}

TEST(Fresnel, DielectricIsTheSameFromBothSides) {
  for (int i = 1; i <= 100; ++i) {
    const float c = static_cast<float>(i) / 100;
    float cos_t, back;
    const float f = fresnel_dielectric(c, 1.5f, &cos_t);
    EXPECT_NEAR(fresnel_dielectric(cos_t, 1 / 1.5f, &back), f, 1e-4f);
    EXPECT_NEAR(back, c, 1e-3f);
  }
}

TEST(Fresnel, ConductorMatchesTheAmplitudeForm) {
  for (const float eta : {0.2f, 1.0f, 3.0f}) {
    for (const float k : {0.0f, 0.5f, 3.9f, 20.0f}) {
      for (int i = 1; i <= 100; ++i) {
        const float c = static_cast<float>(i) / 100;
        if (k == 0 && (1 - c * c) > eta * eta * 0.99f && (1 - c * c) < eta * eta * 1.01f) continue;
        EXPECT_NEAR(fresnel_conductor(c, eta, k), reference(c, {eta, -k}), 5e-4)
            << eta << " " << k << " " << c;
      }
    }
  }
}

TEST(Fresnel, ConductorByReflectance) {
  // pbrt's rule: eta = 1, k = 2 sqrt(r) / sqrt(1 - r) reflects r at normal incidence.
  for (const float r : {0.1f, 0.5f, 0.9f, 0.999f}) {
    EXPECT_NEAR(fresnel_conductor(1.0f, 1.0f, 2 * std::sqrt(r) / std::sqrt(1 - r)), r, 1e-5f);
  }
}

}  // namespace
}  // namespace lightmill::test
