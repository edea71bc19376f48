// Tables of the photon guide: directions are drawn by their densities, which follow the photons; lanes have
// the bits of scalars.
#include "worker/render/guiding/photon_guide.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/statistics.h"
#include "worker/render/math/equal_area.h"

namespace lightmill::test {
namespace {

Vec3<float> on_sphere(float x, float y) {
  return equal_area_square_to_sphere(0.5f * x + 0.5f, 0.5f * y + 0.5f);
}

Photon photon_from(const Vec3<float>& w, float power) {
  Photon p;
  p.w = {w.x, w.y, w.z};
  p.power = power;
  return p;
}

/// Photons on a floor, from a bright spot of the sky, a dim one, and a few from all over one half of it.
std::vector<Photon> sky_with_spots(int count) {
  std::vector<Photon> photons;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    const float x = random.uniform() - 0.5f, y = random.uniform() - 0.5f;
    const float u = random.uniform() - 0.5f, v = random.uniform() - 0.5f;
    Photon p;
    switch (i % 4) {
      case 0:
        p = photon_from(on_sphere(0.9f * u, 0.9f * v), 0.1f);
        break;
      case 1:
        p = photon_from(on_sphere(0.2f + 0.4f * u, -0.1f + 0.2f * v), 0.2f);
        break;
      default:
        p = photon_from(on_sphere(-0.3f + 0.2f * u, 0.2f + 0.3f * v), 1);
        break;
    }
    p.p = {x, y, 0.2f};
    photons.push_back(p);
  }
  return photons;
}

/// Photons on the same floor from a lamp at `from` of radius `radius`, with their derivatives.
std::vector<Photon> of_lamp(const Vec3<float>& from, float radius, int count) {
  std::vector<Photon> photons;
  Random random(6);
  for (int i = 0; i < count; ++i) {
    const Vec3<float> p{random.uniform() - 0.5f, random.uniform() - 0.5f, 0.2f};
    const auto beside = [&] { return radius * (2 * random.uniform() - 1); };
    const Vec3<float> to = Vec3<float>{from.x + beside(), from.y + beside(), from.z} - p;
    const float distance = std::sqrt(dot(to, to));
    const Vec3<float> w = normalize(to);
    Photon photon = photon_from(w, 1);
    photon.p = {p.x, p.y, p.z};
    // d((l - p) / |l - p|) / dp = (w w^T - 1) / |l - p|
    const std::array<float, 3> c{w.x, w.y, w.z};
    for (size_t row = 0; row < 3; ++row) {
      for (size_t k = 0; k < 3; ++k)
        photon.turn[3 * row + k] = (c[row] * c[k] - (row == k ? 1.0f : 0.0f)) / distance;
    }
    photons.push_back(photon);
  }
  return photons;
}

template <class F>
PhotonGuideTables<F> tables_at(const PhotonGuide& guide, const Vec3<F>& p) {
  return {guide, splat_mask<F>(true), splat_int<F>(kDiffuse), p};
}

TEST(PhotonGuide, DrawsByItsDensity) {
  const PhotonGuide guide = make_photon_guide(sky_with_spots(4096));
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
  EXPECT_NEAR(all, 1, 0.01);
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

// The cone around the lamp holds all but a few of its draws.
TEST(PhotonGuide, DensitiesAreNormalised) {
  std::vector<Photon> photons = of_lamp({0.3f, 0.2f, 1}, 0.2f, 4096);
  const PhotonGuide guide = make_photon_guide(photons);
  const auto here = tables_at<float>(guide, {0.1f, 0, 0.2f});
  Random random(3);
  const Vec3<float> axis = normalize(Vec3<float>{0.2f, 0.2f, 0.8f});
  const Frame<float> frame(axis);
  constexpr float kVersine = 0.3f;
  constexpr int kDraws = 400000;
  std::vector<double> batches(32);
  for (double& b : batches) {
    for (int i = 0; i < kDraws; ++i) {
      const float versine = kVersine * random.uniform(), r = std::sqrt(versine * (2 - versine));
      float sine, cosine;
      sincos_2pi(random.uniform(), &sine, &cosine);
      const Vec3<float> w = frame.to_world({r * cosine, r * sine, 1 - versine});
      b += 2 * M_PI * double{kVersine} * double{here.density(w)} / kDraws;
    }
  }
  EXPECT_TRUE(mean_is(estimate(batches), 1, {.resolution = 0.03}));
}

// A lamp is found from between its photons by their derivatives, however small it is beside the cell: without
// them paths go to where it would be seen from other places.
TEST(PhotonGuide, FollowsALampThroughItsCell) {
  for (const float radius : {0.01f, 1e-3f}) {
    std::vector<Photon> photons = of_lamp({0.3f, 0.2f, 1}, radius, 4096);
    Random random(8);
    const auto share_that_hits = [&](const PhotonGuide& guide) {
      int hits = 0;
      for (int i = 0; i < 4000; ++i) {
        const Vec3<float> p{random.uniform() - 0.5f, random.uniform() - 0.5f, 0.2f};
        const float u = random.uniform(), v = random.uniform();
        const auto tables = tables_at<float>(guide, p);
        if (!tables.mask) continue;
        const Vec3<float> w = tables.draw(u, v);
        if (w.z <= 0) continue;
        const float t = 0.8f / w.z;
        hits += std::fabs(p.x + t * w.x - 0.3f) < radius && std::fabs(p.y + t * w.y - 0.2f) < radius;
      }
      return hits / 4000.0;
    };
    const double found = share_that_hits(make_photon_guide(photons));
    EXPECT_GT(found, 0.25) << radius;
    for (Photon& p : photons) p.turn = {};
    EXPECT_LT(share_that_hits(make_photon_guide(photons)), 0.7 * found) << radius;
  }
}

// Two lamps close to each other: photons of one need not be explained by those of the other.
TEST(PhotonGuide, TellsTwoWaysApart) {
  std::vector<Photon> photons = of_lamp({0.3f, 0.2f, 1}, 1e-3f, 4096),
                      other = of_lamp({0.4f, 0.2f, 1}, 1e-3f, 4096);
  for (size_t i = 0; i < photons.size(); i += 2) photons[i] = other[i];
  const PhotonGuide guide = make_photon_guide(photons);
  const auto tables = tables_at<float>(guide, {0, 0, 0.2f});
  ASSERT_TRUE(tables.mask);
  const auto density = [&](float x) { return double{tables.density(normalize(Vec3<float>{x, 0.2f, 0.8f}))}; };
  EXPECT_GT(density(0.3f), 1000 * density(0.35f));
  EXPECT_GT(density(0.4f), 1000 * density(0.35f));
}

TEST(PhotonGuide, FollowsTheFlux) {
  const PhotonGuide guide = make_photon_guide(sky_with_spots(4096));
  const auto tables = tables_at<float>(guide, {0, 0, 0.2f});
  const auto density_at = [&](float x, float y) {
    return double{tables.density(equal_area_square_to_sphere(0.5f * x + 0.5f, 0.5f * y + 0.5f))};
  };
  // By flux the first spot has 0.91 of all on 0.06 pi steradians, the second 0.09 on 0.08 pi.
  EXPECT_GT(density_at(-0.3f, 0.2f), 1.5);
  EXPECT_LT(density_at(-0.3f, 0.2f), 7);
  EXPECT_GT(density_at(0.2f, -0.1f), 0.15);
  EXPECT_LT(density_at(0.2f, -0.1f), 0.8);
  EXPECT_LT(density_at(0.8f, -0.8f), 0.02) << "nothing comes from there";
}

TEST(PhotonGuide, CellsWithFewPhotonsShareATable) {
  std::vector<Photon> photons = sky_with_spots(PhotonGuide::kLobes);
  for (size_t i = 0; i < photons.size(); ++i) photons[i].p = {static_cast<float>(i) / 64, 0, 0};
  const PhotonGuide one = make_photon_guide(photons);
  EXPECT_EQ(one.boxes.size(), 1u);
  photons.pop_back();
  EXPECT_TRUE(make_photon_guide(photons).empty()) << "too few for any";
  EXPECT_TRUE(make_photon_guide({}).empty());
  // Two crowds far from each other have a table each, and what lies between has none.
  photons = sky_with_spots(4096);
  for (size_t i = 0; i < photons.size(); ++i) photons[i].p = {i % 2 ? 0.001f * photons[i].p.x : 1.0f, 0, 0};
  const PhotonGuide two = make_photon_guide(photons);
  EXPECT_GE(two.boxes.size(), 2u);
  EXPECT_TRUE(tables_at<float>(two, {1, 0, 0}).mask);
  EXPECT_FALSE(tables_at<float>(two, {0.5f, 0, 0}).mask);
}

TEST(PhotonGuide, PhotonsOnOneSpotMakeNoNeedle) {
  Photon one = photon_from(on_sphere(0.25f, -0.5f), 1);
  one.p = {0.1f, 0.2f, 0.3f};
  std::vector<Photon> photons(1000, one);
  photons.back().p.x = 0.4f;  // a grid needs an extent
  const PhotonGuide guide = make_photon_guide(photons);
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

TEST(PhotonGuide, WhatIsNarrowIsNotGuided) {
  const PhotonGuide guide = make_photon_guide(sky_with_spots(4096));
  for (BsdfKind kind = 0; kind < kBsdfKinds; ++kind) {
    EXPECT_FALSE(is_guided(kind) && has_delta(kind)) << kind;
    const PhotonGuideTables<float> tables(guide, true, kind, {0, 0, 0.2f});
    EXPECT_EQ(tables.mask, is_guided(kind)) << kind;
  }
  EXPECT_FALSE(is_guided(kPhaseFunction));
}

TEST(PhotonGuide, LanesHaveTheBitsOfScalars) {
  std::vector<Photon> photons = sky_with_spots(1 << 16);
  const PhotonGuide guide = make_photon_guide(photons);
  EXPECT_GT(guide.boxes.size(), 100u);
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
    const PhotonGuideTables<Float8> tables(guide, splat_mask<Float8>(true), kind, p);
    if (!any(tables.mask)) continue;
    const Vec3<Float8> w = tables.draw(u, v);
    const Float8 density = tables.density(w), elsewhere = tables.density(other);
    for (int l = 0; l < 8; ++l) {
      const PhotonGuideTables<float> one(guide, true, kind[l], {p.x[l], p.y[l], p.z[l]});
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
