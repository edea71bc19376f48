// Tables of the caustic guide: directions are drawn by their densities, which follow the photons; lanes have
// the bits of scalars.
#include "worker/render/light/caustic_guide.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"

namespace lightmill::test {
namespace {

/// Photons on a floor, from a bright spot of the sky, a dim one, and a few from all over one half of it.
std::vector<Photon> sky_with_spots(int count) {
  std::vector<Photon> photons;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    Photon& p = photons.emplace_back();
    p.p = {random.uniform() - 0.5f, random.uniform() - 0.5f, 0.2f};
    const float u = random.uniform() - 0.5f, v = random.uniform() - 0.5f;
    switch (i % 4) {
      case 0:
        p.x = 0.9f * u, p.y = 0.9f * v, p.power = 0.1f;
        break;
      case 1:
        p.x = 0.2f + 0.4f * u, p.y = -0.1f + 0.2f * v, p.power = 0.2f;
        break;
      default:
        p.x = -0.3f + 0.2f * u, p.y = 0.2f + 0.3f * v, p.power = 1;
        break;
    }
  }
  return photons;
}

template <class F>
GuideTables<F> tables_at(const CausticGuide& guide, const Vec3<F>& p) {
  return {guide, splat_mask<F>(true), splat_int<F>(kDiffuse), p};
}

TEST(CausticGuide, DrawsByItsDensity) {
  const CausticGuide guide = make_caustic_guide(sky_with_spots(4096));
  ASSERT_FALSE(guide.empty());
  const auto tables = tables_at<float>(guide, {0.1f, 0.05f, 0.2f});
  ASSERT_TRUE(tables.mask);
  constexpr int kSide = 24, kFine = 64, kSamples = 200000;
  // Densities over the square by a fine grid, against draws.
  std::vector<double> expected(size_t{kSide} * kSide), observed(expected.size());
  double all = 0;
  for (int y = 0; y < kSide * kFine; ++y) {
    for (int x = 0; x < kSide * kFine; ++x) {
      const float s = (static_cast<float>(x) + 0.5f) / (kSide * kFine),
                  t = (static_cast<float>(y) + 0.5f) / (kSide * kFine);
      const double part = 4 * M_PI * double{tables.density(equal_area_square_to_sphere(s, t))} /
                          (double{kSide} * kFine * kSide * kFine);
      expected[static_cast<size_t>(y / kFine * kSide + x / kFine)] += part * kSamples;
      all += part;
    }
  }
  EXPECT_NEAR(all, 1, 0.01) << "leaves are finer than the grid";
  Random random(2);
  for (int i = 0; i < kSamples; ++i) {
    const float u = random.uniform(), v = random.uniform();
    const Vec3<float> w = tables.draw(u, v);
    ASSERT_NEAR(dot(w, w), 1, 1e-5);
    ASSERT_GT(tables.density(w), 0);
    float s, t;
    equal_area_sphere_to_square(w, &s, &t);
    const auto cell = [](float c) { return std::min(static_cast<int>(c * kSide), kSide - 1); };
    ++observed[static_cast<size_t>(cell(t) * kSide + cell(s))];
  }
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

// Exactly, by importance sampling: mean of f / density over draws is the integral of f over the window.
TEST(CausticGuide, DensitiesAreNormalised) {
  const CausticGuide guide = make_caustic_guide(sky_with_spots(4096));
  const auto tables = tables_at<float>(guide, {0, 0, 0.2f});
  const GuideWindow& w = guide.windows[static_cast<size_t>(
      guide.table_of[static_cast<size_t>(guide.grid.at<float>({0, 0, 0.2f}))])];
  Random random(3);
  std::vector<double> batches(32);
  for (double& b : batches) {
    for (int i = 0; i < 20000; ++i) {
      const float u = random.uniform(), v = random.uniform();
      b += 1 / double{tables.density(tables.draw(u, v))} / 20000;
    }
  }
  const double window = double{w.x1 - w.x0} * double{w.y1 - w.y0} * M_PI;
  EXPECT_TRUE(mean_is(estimate(batches), window, {.resolution = 0.05}));
}

TEST(CausticGuide, FollowsTheFlux) {
  const CausticGuide guide = make_caustic_guide(sky_with_spots(4096));
  const auto tables = tables_at<float>(guide, {0, 0, 0.2f});
  const auto density_at = [&](float x, float y) {
    return double{tables.density(equal_area_square_to_sphere(0.5f * x + 0.5f, 0.5f * y + 0.5f))};
  };
  // By flux the first spot has 0.91 of all on 0.06 pi steradians, the second 0.09 on 0.08 pi.
  EXPECT_GT(density_at(-0.3f, 0.2f), 3);
  EXPECT_LT(density_at(-0.3f, 0.2f), 7);
  EXPECT_GT(density_at(0.2f, -0.1f), 0.15);
  EXPECT_LT(density_at(0.2f, -0.1f), 0.8);
  EXPECT_LT(density_at(0.3f, 0.3f), 0.5);
  EXPECT_GT(density_at(0.3f, 0.3f), 0) << "dim light counts, too";
  EXPECT_EQ(density_at(0.8f, 0.8f), 0) << "nothing comes from there";
}

TEST(CausticGuide, CellsWithFewPhotonsShareATable) {
  std::vector<Photon> photons = sky_with_spots(64);
  for (size_t i = 0; i < photons.size(); ++i) photons[i].p = {static_cast<float>(i) / 64, 0, 0};
  const CausticGuide one = make_caustic_guide(photons);
  EXPECT_EQ(one.windows.size(), 1u);
  photons.pop_back();
  EXPECT_TRUE(make_caustic_guide(photons).empty()) << "too few for any";
  EXPECT_TRUE(make_caustic_guide({}).empty());
  // Two crowds far from each other have a table each, and what lies between has none.
  photons = sky_with_spots(4096);
  for (size_t i = 0; i < photons.size(); ++i) photons[i].p = {i % 2 ? 0.001f * photons[i].p.x : 1.0f, 0, 0};
  const CausticGuide two = make_caustic_guide(photons);
  EXPECT_GE(two.windows.size(), 2u);
  EXPECT_TRUE(tables_at<float>(two, {1, 0, 0}).mask);
  EXPECT_FALSE(tables_at<float>(two, {0.5f, 0, 0}).mask);
}

TEST(CausticGuide, PhotonsOnOneSpotMakeNoNeedle) {
  std::vector<Photon> photons(1000, Photon{{0.1f, 0.2f, 0.3f}, 0.25f, -0.5f, 1});
  photons.back().p.x = 0.4f;  // a grid needs an extent
  const CausticGuide guide = make_caustic_guide(photons);
  const auto tables = tables_at<float>(guide, {0.1f, 0.2f, 0.3f});
  ASSERT_TRUE(tables.mask);
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const float u = random.uniform(), v = random.uniform();
    const float density = tables.density(tables.draw(u, v));
    ASSERT_TRUE(std::isfinite(density));
    ASSERT_GT(density, 0);
  }
}

TEST(CausticGuide, WhatIsNarrowIsNotGuided) {
  const CausticGuide guide = make_caustic_guide(sky_with_spots(4096));
  for (BsdfKind kind = 0; kind < kBsdfKinds; ++kind) {
    EXPECT_FALSE(is_guided(kind) && has_delta(kind)) << kind;
    const GuideTables<float> tables(guide, true, kind, {0, 0, 0.2f});
    EXPECT_EQ(tables.mask, is_guided(kind)) << kind;
  }
  EXPECT_FALSE(is_guided(kPhaseFunction));
}

TEST(CausticGuide, LanesHaveTheBitsOfScalars) {
  std::vector<Photon> photons = sky_with_spots(1 << 16);
  const CausticGuide guide = make_caustic_guide(photons);
  EXPECT_GT(guide.windows.size(), 100u);
  Random random(5);
  for (int round = 0; round < 2000; ++round) {
    Vec3<Float8> p, other;
    Float8 u, v;
    Int8 kind;
    for (int l = 0; l < 8; ++l) {
      p.x[l] = random.uniform() - 0.5f, p.y[l] = random.uniform() - 0.5f, p.z[l] = 0.2f;
      u[l] = random.uniform(), v[l] = random.uniform();
      kind[l] = random.uniform() < 0.8f   ? kDiffuse
                : random.uniform() < 0.5f ? kSmoothDielectric
                                          : kRoughCoated;
      const Vec3<float> w = equal_area_square_to_sphere(random.uniform(), random.uniform());
      other.x[l] = w.x, other.y[l] = w.y, other.z[l] = w.z;
    }
    const GuideTables<Float8> tables(guide, splat_mask<Float8>(true), kind, p);
    if (!any(tables.mask)) continue;
    const Vec3<Float8> w = tables.draw(u, v);
    const Float8 density = tables.density(w), elsewhere = tables.density(other);
    for (int l = 0; l < 8; ++l) {
      const GuideTables<float> one(guide, true, kind[l], {p.x[l], p.y[l], p.z[l]});
      ASSERT_EQ(one.mask, tables.mask[l] != 0);
      if (!one.mask) continue;
      const Vec3<float> d = one.draw(u[l], v[l]);
      ASSERT_EQ(float_bits(d.x), float_bits(w.x[l]));
      ASSERT_EQ(float_bits(d.z), float_bits(w.z[l]));
      ASSERT_EQ(float_bits(one.density(d)), float_bits(density[l]));
      ASSERT_EQ(float_bits(one.density({other.x[l], other.y[l], other.z[l]})), float_bits(elsewhere[l]));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
