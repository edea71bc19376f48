// Light tree: probabilities sum to one, follow what sample() does, are never zero for a light that reaches
// the point, and give less variance than selection by power.
#include "worker/render/light/light_tree.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/light/light_cases.h"
#include "worker/render/light/light_sampling.h"

namespace lightmill::test {
namespace {

Vec3d unit_vector(Random& random) {
  const double z = random.between(-1, 1), a = random.between(0, 2 * M_PI), r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

/// `count` lights of every kind within [-1, 1]^3, of sizes and radiances over decades.
TestScene crowd(int count, uint64_t seed) {
  TestScene s;
  Random random(seed);
  const int black = s.diffuse(0);
  for (int i = 0; i < count; ++i) {
    const Vec3d p{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double size = std::pow(10.0, random.between(-4, -1));
    const auto level = static_cast<float>(std::pow(10.0, random.between(-2, 2)));
    const Emits emits{{level, level, level / 2}, i % 3 == 0, i % 7 == 0};
    if (i % 5 == 0) {
      s.point_light(p, {level, level, level});
    } else if (i % 5 == 1) {
      s.sphere(p, size, black, emits);
    } else if (i % 5 == 2) {
      const double width = random.between(3, 90);
      s.scene.lights.push_back(
          {SpotLight{{level, level, level}, p, unit_vector(random), width / 2, width}, {}});
    } else {
      s.triangle(p, p + unit_vector(random) * size, p + unit_vector(random) * size, black, emits);
    }
  }
  return s;
}

double selection(const LightTable& lights, int32_t light, const Vec3<float>& p) {
  return double{direct_selection<float>(lights, light, p)};
}

TEST(LightTree, ProbabilitiesSumToOne) {
  for (const bool far : {false, true}) {
    TestScene s = crowd(300, 3);
    if (far) {
      s.environment({0.1f, 0.1f, 0.1f});
      s.scene.lights.push_back({DistantLight{{2, 2, 2}, {0, 0, 1}}, {}});
    }
    const LightScene scene(s);
    ASSERT_FALSE(scene.lights().tree.empty());
    Random random(4);
    for (int k = 0; k < 200; ++k) {
      const double reach = k % 2 ? 1 : 30;
      const Vec3<float> p = scene.at(random.between(-reach, reach), random.between(-reach, reach),
                                     random.between(-reach, reach));
      double sum = 0;
      for (int32_t i = 0; i < scene.lights().count(); ++i) sum += selection(scene.lights(), i, p);
      ASSERT_NEAR(sum, 1, 1e-5);
    }
  }
}

TEST(LightTree, SelectionFollowsTheProbabilities) {
  TestScene s = crowd(60, 5);
  s.environment({0.1f, 0.1f, 0.1f});
  const LightScene scene(s);
  const LightTable& lights = scene.lights();
  Random random(6);
  constexpr int kPoints = 6, kSamples = 200000;
  for (int k = 0; k < kPoints; ++k) {
    const Vec3<float> p = scene.at(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
    std::vector<double> observed(static_cast<size_t>(lights.count())), expected(observed.size());
    for (size_t i = 0; i < expected.size(); ++i)
      expected[i] = kSamples * selection(lights, static_cast<int32_t>(i), p);
    for (int i = 0; i < kSamples; ++i) {
      float probability;
      const int32_t light = select_direct<float>(lights, p, random.uniform(), random.uniform(), &probability);
      ++observed[static_cast<size_t>(light)];
      ASSERT_FLOAT_EQ(probability, direct_selection<float>(lights, light, p));
    }
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), kPoints)) << k;
  }
}

/// Largest radiance that a light sends to `p` from any of its points, by trying them.
bool reaches(const LightTable& lights, int32_t light, const Vec3<float>& p) {
  const LightRecord<float> r(lights, light);
  const LightType type = lights.type[static_cast<size_t>(light)];
  if (type == kPointLight || type == kSphereLight) return true;
  const Vec3<float> d = p - r.vec(kLightP);
  const float along = dot(r.vec(kLightN), d) / std::sqrt(dot(d, d));
  if (type == kSpotLight) return 1 - along < r.scalar(5);
  return along > 0 || (r.scalar(kLightTwoSided) > 0 && along < 0);
}

TEST(LightTree, NoLightThatReachesThePointIsLeftOut) {
  for (const int count : {17, 200, 2000}) {
    const LightScene scene(crowd(count, 7));
    const LightTable& lights = scene.lights();
    Random random(8);
    for (int k = 0; k < 40; ++k) {
      const double reach = k % 4 == 0 ? 100 : 1;
      const Vec3<float> p = scene.at(random.between(-reach, reach), random.between(-reach, reach),
                                     random.between(-reach, reach));
      for (int32_t i = 0; i < lights.count(); ++i) {
        if (reaches(lights, i, p)) {
          ASSERT_GT(selection(lights, i, p), 0) << i;
        }
      }
      // Also at a point on, or a hair in front of, a light.
      const auto i = static_cast<int32_t>(random.between(0, lights.count()));
      const LightRecord<float> r(lights, i);
      ASSERT_GT(selection(lights, i, r.vec(kLightP)), 0);
      ASSERT_GT(selection(lights, i, r.vec(kLightP) + r.vec(kLightN) * 1e-6f), 0);
    }
  }
}

// Powers over 60 decades, all lights at one place, and distances beyond reason: finite and never zero.
TEST(LightTree, ExtremePowersAndPlaces) {
  std::vector<LightBound> bounds(100);
  for (int i = 0; i < 100; ++i) {
    LightBound& b = bounds[static_cast<size_t>(i)];
    b.light = i;
    const double x = i < 50 ? 0 : std::ldexp(1.0, -i);
    for (int c = 0; c < 3; ++c) b.lo[c] = b.hi[c] = b.center[c] = x;
    b.cos_emission = -1;
    b.intensity = std::pow(10.0, (i * 37) % 60 - 30);
  }
  LightTree tree;
  tree.build(bounds, 100);
  const Vec3<float> points[] = {{0, 0, 0}, {1, 0, 0}, {1e9f, -1e9f, 1e9f}, {1e-30f, 0, 0}};
  for (const Vec3<float>& p : points) {
    double sum = 0;
    for (int32_t i = 0; i < 100; ++i) {
      float probability;
      tree.probability(&p, &i, 1, &probability);
      ASSERT_GT(probability, 0) << i;
      sum += double{probability};
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    for (const double u : {0.0, 0.5, 1 - 0x1p-53}) {
      LightTree::Choice c;
      tree.sample(&p, &u, 1, &c);
      EXPECT_TRUE(c.light >= 0 && c.light < 100);
    }
  }
}

TEST(LightTree, LanesGiveTheSameBits) {
  const LightScene scene(crowd(500, 9));
  const LightTable& lights = scene.lights();
  Random random(10);
  for (int k = 0; k < 100; ++k) {
    Vec3<Float8> p;
    Float8 u, more;
    for (int l = 0; l < 8; ++l) {
      p.x[l] = static_cast<float>(random.between(-1, 1));
      p.y[l] = static_cast<float>(random.between(-1, 1));
      p.z[l] = static_cast<float>(random.between(-1, 1));
      u[l] = random.uniform();
      more[l] = random.uniform();
    }
    Float8 probability;
    const Int8 light = select_direct<Float8>(lights, p, u, more, &probability);
    for (int l = 0; l < 8; ++l) {
      float one;
      ASSERT_EQ(light[l], select_direct<float>(lights, {p.x[l], p.y[l], p.z[l]}, u[l], more[l], &one));
      ASSERT_EQ(probability[l], one);
    }
  }
}

/// Variance over mean^2 of the estimate of the light at `p` (radiance x cosine at the light / distance^2,
/// without the receiver), by selection.
double relative_variance(const LightTable& lights, const Vec3<float>& p, bool by_power, Random& random) {
  constexpr int kSamples = 20000;
  double sum = 0, squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    const float u = random.uniform(), more = random.uniform(), v = random.uniform(), w = random.uniform();
    const DirectSample<float> d = sample_direct<float>(lights, p, u, more, v, w);
    double x = d.pdf > 0 ? double{d.radiance.x} / double{d.pdf} : 0;
    if (by_power) {
      // The same, with the light drawn by power and everything else alike.
      const int32_t light = select_light<float>(lights, u);
      const LightRecord<float> r(lights, light);
      float b1, b2;
      square_to_triangle(v, w, &b1, &b2);
      const Vec3<float> to = r.vec(kLightP) + r.vec(kLightE1) * b1 + r.vec(kLightE2) * b2 - p;
      const double d2 = double{dot(to, to)}, cosine = -double{dot(to, r.vec(kLightN))} / std::sqrt(d2);
      x = std::max(0.0, cosine) * double{r.scalar(kLightRadiance)} * double{r.scalar(kLightArea)} / d2 /
          double{r.scalar(kLightSelect)};
    }
    sum += x / kSamples;
    squares += x * x / kSamples;
  }
  return squares / (sum * sum) - 1;
}

// A street of lamps: selection by power has a variance of the order of their number, the tree hardly any.
TEST(LightTree, LessVarianceThanPower) {
  TestScene s;
  Random random(11);
  const int black = s.diffuse(0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p{random.between(-10, 10), random.between(0.5, 1), random.between(-10, 10)};
    s.triangle(p, p + Vec3d{0.01, 0, 0}, p + Vec3d{0, 0, 0.01}, black, {.radiance = {1, 1, 1}});
  }
  const LightScene scene(s);
  for (int k = 0; k < 5; ++k) {
    const Vec3<float> p = scene.at(random.between(-10, 10), 0, random.between(-10, 10));
    const double tree = relative_variance(scene.lights(), p, false, random),
                 power = relative_variance(scene.lights(), p, true, random);
    EXPECT_LT(tree * 10, power) << tree << " against " << power;
    EXPECT_LT(tree, 3);
  }
}

}  // namespace
}  // namespace lightmill::test
