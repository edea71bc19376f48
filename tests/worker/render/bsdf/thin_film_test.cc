// A thin film's reflectance against waves that interfere, wavelength by wavelength; and what a material with
// a film reflects in a white furnace.
#include "worker/render/bsdf/thin_film.h"

#include <gtest/gtest.h>

#include <complex>

#include "common/scene/spectrum/spectrum.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

/// Colour under D65, at normal incidence, of a film of index `film` and `nm` between air and `base` (Airy's
/// sum of all orders).
Rgb by_waves(double film, double base, double nm) {
  SampledSpectrum reflectance;
  const double outer = (1 - film) / (1 + film), inner = (film - base) / (film + base);
  for (double wavelength = 380; wavelength <= 780; wavelength += 2) {
    const auto wave = std::polar(1.0, 4 * M_PI * film * nm / wavelength);
    reflectance.wavelengths.push_back(wavelength);
    reflectance.values.push_back(std::norm((outer + inner * wave) / (1.0 + outer * inner * wave)));
  }
  return factor_to_rgb(reflectance);
}

double f0_of(double index) { return (index - 1) * (index - 1) / ((index + 1) * (index + 1)); }

// Where Schlick's terms are exact. What is left are the Gaussian fits and the orders above the second: up to
// 0.006 and 4 % of the brightest colour over a micrometre.
TEST(ThinFilm, AgreesWithInterferingWaves) {
  struct Pair {
    double film, base;
  };
  for (const Pair p : {Pair{1.3, 1.5}, Pair{1.8, 1.5}, Pair{1.33, 1}, Pair{1.5, 3}, Pair{2, 9}}) {
    const auto f0 = static_cast<float>(f0_of(p.base));
    float brightest = 0, worst = 0;
    for (double nm = 0; nm <= 1000; nm += 10) {
      const Vec3<float> f =
          ThinFilm<float>(1, static_cast<float>(p.film), static_cast<float>(nm)).reflectance({f0, f0, f0});
      const Rgb expected = by_waves(p.film, p.base, nm);
      brightest = std::max({brightest, expected.r, expected.g, expected.b});
      worst = std::max(
          {worst, std::fabs(f.x - expected.r), std::fabs(f.y - expected.g), std::fabs(f.z - expected.b)});
    }
    EXPECT_LT(worst, 0.006f + 0.04f * brightest) << p.film << " on " << p.base;
    EXPECT_GT(worst, 0) << "that would be too good";
  }
}

TEST(ThinFilm, OfNoThicknessChangesNothing) {
  for (const float base : {1.0f, 1.33f, 1.5f, 2.4f}) {
    const auto f0 = static_cast<float>(f0_of(base));
    for (const float ior : {1.0f, 1.3f, 1.8f}) {
      const Vec3<float> f = ThinFilm<float>(1, ior, 0).reflectance({f0, f0, f0});
      EXPECT_NEAR(f.x, f0, 0.012f) << ior << " on " << base;  // of orders above the second
      EXPECT_NEAR(f.x, f.y, 1e-6f);                           // weights of seven digits
      EXPECT_NEAR(f.x, f.z, 1e-6f);
    }
  }
}

TEST(ThinFilm, ReflectsAllAtGrazingAngles) {
  const Vec3<float> f = ThinFilm<float>(0, 1.5f, 300).reflectance({0.04f, 0.5f, 1});
  EXPECT_NEAR(f.x, 1, 1e-4f);
  EXPECT_NEAR(f.y, 1, 1e-4f);
  EXPECT_NEAR(f.z, 1, 1e-4f);
}

/// What a white furnace makes of a case, per channel, by its samples.
Vec3<float> furnace(const BsdfCase& bsdf, double degrees) {
  Random random(31);
  constexpr int kSamples = 64000;
  double sum[3] = {};
  for (int i = 0; i < kSamples; ++i) {
    const BsdfSample<float> s = bsdf.sample(direction_at(degrees), random);
    if (!s.valid) continue;
    sum[0] += double{s.weight.x}, sum[1] += double{s.weight.y}, sum[2] += double{s.weight.z};
  }
  return {static_cast<float>(sum[0] / kSamples), static_cast<float>(sum[1] / kSamples),
          static_cast<float>(sum[2] / kSamples)};
}

// On a white dielectric the brightest channel of the film takes from the base what it reflects: that channel
// stays white within 2 % where it is the brightest at all angles, none is above it.
TEST(ThinFilm, AFurnaceIsNeverBrighterThanItself) {
  int found = 0;
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (!bsdf.name.starts_with("film_")) continue;
    ++found;
    for (const double degrees : {0.0, 30.0, 60.0, 80.0, 88.0, 92.0, 120.0}) {
      const Vec3<float> e = furnace(bsdf, degrees);
      EXPECT_LT(max_component(e), 1.01f) << bsdf.name << " at " << degrees;
      if (bsdf.name.starts_with("film_white") && degrees < 80) {
        EXPECT_GT(max_component(e), 0.93f) << bsdf.name << " at " << degrees;
      }
    }
  }
  EXPECT_GE(found, 9);
}

}  // namespace
}  // namespace lightmill::test
