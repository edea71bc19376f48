// Direct light of known irradiance on a plane y = 0, and colour bleeding as a number. alpha =
// 1e-4 per comparison.
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/mesh/tessellate.h"
#include "tests/statistical/oracles/form_factor.h"
#include "tests/support/render.h"

namespace lightmill::test {
namespace {

constexpr int kLightBatches = 16;
constexpr double kLightRho = 0.5;
const Vec3d kUp{0, 1, 0};

class LightOracle : public ::testing::TestWithParam<Integrator> {
 protected:
  /// A floor under a light; the camera looks down at its middle from aside.
  static TestScene floor_scene() {
    TestScene s;
    s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(kLightRho));
    s.camera({0.5, 2, -1}, {0, 0, 0}, 30).film(16, 16);
    return s;
  }
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kLightBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
  MeanTest test(double lt_resolution = 0.08) const {
    return {.resolution = GetParam() == Integrator::kLt ? lt_resolution : 0.02};
  }
};

// Oracle 7: a point light at height h: L = rho I h / (pi (h^2 + x^2)^(3/2)).
TEST_P(LightOracle, PlaneUnderAPointLight) {
  TestScene s = floor_scene();
  s.point_light({0.3, 1.5, 0.2}, {4, 4, 4});
  const auto radiance = [](const Vec3d& p) {
    const double d2 = (p.x - 0.3) * (p.x - 0.3) + (p.z - 0.2) * (p.z - 0.2) + 1.5 * 1.5;
    return kLightRho * 4 * 1.5 / (M_PI * std::pow(d2, 1.5));
  };
  const Batches b = render(s, 1, 2048);
  EXPECT_TRUE(mean_is(b.mean(), mean_over_plane(s.scene, 0, radiance), test()));
}

// Oracle 8: a sphere light of radius r at distance d: E = pi L (r / d)^2 cos theta.
TEST_P(LightOracle, PlaneUnderASphereLight) {
  for (const double ratio : {1e-3, 0.1, 0.5, 0.99}) {
    if (GetParam() == Integrator::kLt && ratio != 0.1)
      continue;  // for the others too few light paths land in the view
    TestScene s = floor_scene();
    const double h = 1.2, r = ratio * h, emitted = 1 / (ratio * ratio);
    s.camera({0.5, 2, -1.5}, {0, 0, 0}, 15);
    if (ratio > 0.4) s.camera({2.2, 0.15, 0}, {0.5, 0, 0}, 1.5);  // from beside the sphere, below its belly
    const auto e = static_cast<float>(emitted);
    s.sphere({0, h, 0}, r, s.diffuse(0), {.radiance = {e, e, e}});
    const auto radiance = [&](const Vec3d& p) {
      const double d2 = p.x * p.x + p.z * p.z + h * h;
      return kLightRho * emitted * r * r * h / std::pow(d2, 1.5);
    };
    const int64_t spp = GetParam() == Integrator::kLt ? 8192 : 1024;
    EXPECT_TRUE(mean_is(render(s, 1, spp).mean(), mean_over_plane(s.scene, 0, radiance), test(0.15)))
        << "r/d " << ratio;
  }
}

// Oracle 10: a polygon light by Lambert's formula.
TEST_P(LightOracle, PlaneUnderAPolygonLight) {
  TestScene s = floor_scene();
  const Vec3d a{-0.5, 0.8, -0.3}, u{0.9, 0.2, 0}, v{0, 0.1, 0.8};
  s.quad(a, u, v, s.diffuse(0), {.radiance = {3, 3, 3}});
  const std::vector<Vec3d> corners{a, a + u, a + u + v, a + v};
  s.camera({0.9, 0.6, -1.4}, {0, 0, 0}, 20);
  const auto radiance = [&](const Vec3d& p) {
    return kLightRho / M_PI * 3 * polygon_irradiance(corners, p, kUp);
  };
  const int64_t spp = GetParam() == Integrator::kLt ? 4096 : 1024;
  EXPECT_TRUE(mean_is(render(s, 1, spp).mean(), mean_over_plane(s.scene, 0, radiance), test()));
}

// Oracle 9: a disk of radius R over a parallel plane at distance d. On its axis E = pi L R^2 / (R^2 + d^2);
// at distance x from it E = pi L / 2 (1 - (x^2 + d^2 - R^2) / sqrt((x^2 + d^2 + R^2)^2 - 4 R^2 x^2)).
TEST_P(LightOracle, CoaxialDisk) {
  constexpr double kRadius = 0.7, kHeight = 1.0, kEmitted = 2;
  TestScene s = floor_scene();
  ShapeDescription disk;
  const auto mesh = std::make_shared<const TriangleMesh>(disk_mesh(-kHeight, kRadius, 0, 2 * M_PI));
  disk.kind = MeshShape{mesh};
  disk.object_to_world.m = {{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}};  // z to -y
  disk.material = s.diffuse(0);
  disk.area_light = static_cast<int>(s.scene.area_lights.size());
  s.scene.area_lights.push_back({{kEmitted, kEmitted, kEmitted}, false, {}});
  s.scene.shapes.push_back(disk);
  s.camera({1.5, 0.9, 0}, {0, 0, 0}, 2).film(8, 8);
  const auto radiance = [&](const Vec3d& p) {
    const double x2 = p.x * p.x + p.z * p.z, d2 = kHeight * kHeight, r2 = kRadius * kRadius,
                 sum = x2 + d2 + r2;
    const double form = 0.5 * (1 - (x2 + d2 - r2) / std::sqrt(sum * sum - 4 * r2 * x2));
    return kLightRho * kEmitted * form;
  };
  EXPECT_NEAR(radiance({0, 0, 0}), kLightRho * kEmitted * kRadius * kRadius / (1 + kRadius * kRadius), 1e-12);
  // Without noise: the polygon that stands for the disk has its irradiance.
  std::vector<Vec3d> rim;
  for (const Vec3f& p : mesh->positions) {
    if (p.x != 0 || p.y != 0) rim.push_back({p.x, -double{p.z}, p.y});
  }
  rim.pop_back();  // the first again
  for (const double x : {0.0, 0.3, 0.7, 2.0}) {
    const double irradiance = kEmitted * polygon_irradiance(rim, {x, 0, 0}, kUp);
    EXPECT_NEAR(kLightRho / M_PI * irradiance / radiance({x, 0, 0}), 1, 2e-6) << x;
  }
  const int64_t spp = GetParam() == Integrator::kLt ? 65536 : 1024;
  EXPECT_TRUE(mean_is(render(s, 1, spp).mean(), mean_over_plane(s.scene, 0, radiance), test(0.15)));
}

// Oracle 11: the floor next to an emitting wall of height h and (nearly) infinite length, as x -> 0.
TEST_P(LightOracle, CornerNextToAnEmittingStrip) {
  for (const double x : {1e-1, 1e-3}) {
    TestScene s;
    s.quad({0, 0, -100}, {0, 0, 200}, {200, 0, 0}, s.diffuse(kLightRho));
    const double h = 0.5;
    s.quad({0, 0, -100}, {0, h, 0}, {0, 0, 200}, s.diffuse(0), {.radiance = {1, 1, 1}});
    s.camera({x + 1.0, 0.8, 0}, {x, 0, 0}, 0.02 * std::min(1.0, x * 50)).film(8, 8);
    const auto radiance = [&](const Vec3d& p) {
      return kLightRho / M_PI * (M_PI / 2) * (1 - p.x / std::sqrt(p.x * p.x + h * h));
    };
    if (GetParam() == Integrator::kLt) continue;  // so small a view catches no light path
    EXPECT_TRUE(
        mean_is(render(s, 1, 4096).mean(), mean_over_plane(s.scene, 0, radiance), {.resolution = 0.05}))
        << "x " << x;
  }
}

/// Colour bleeding: a white floor y = 0 beside a red wall x = 0, a point light, two scattering events. The
/// floor's direct light is grey; the red wall adds a coloured bounce, by quadrature over the wall.
struct Bleeding {
  static constexpr double kWall[3] = {0.8, 0.1, 0.05};
  static constexpr double kSide = 1;
  Vec3d light{0.8, 0.7, 0.5};

  double radiance(const Vec3d& p, int channel) const {
    auto irradiance = [&](const Vec3d& q, const Vec3d& n) {
      const Vec3d d = light - q;
      return std::max(0.0, dot(d, n)) / std::pow(dot(d, d), 1.5);
    };
    constexpr int kSteps = 96;
    double bounce = 0;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j < kSteps; ++j) {
        const Vec3d q{0, kSide * (i + 0.5) / kSteps, kSide * (j + 0.5) / kSteps};
        const Vec3d d = p - q;
        const double d2 = dot(d, d);
        const double g = d.x * -d.y / (d2 * d2);  // cosines at the wall (x) and at the floor (y)
        bounce += irradiance(q, {1, 0, 0}) * g * kSide * kSide / (kSteps * kSteps);
      }
    }
    return kLightRho / M_PI * (irradiance(p, kUp) + kWall[channel] / M_PI * bounce);
  }
};

TEST_P(LightOracle, ColourBleedingAsANumber) {
  TestScene s;
  const Bleeding scene;
  s.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, s.diffuse(kLightRho));
  s.quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, s.diffuse(Rgb{0.8f, 0.1f, 0.05f}));
  s.point_light(scene.light, {1, 1, 1});
  s.camera({0.9, 0.6, 0.5}, {0.15, 0, 0.5}, 8).film(8, 8);
  const Batches b = render(s, 2, GetParam() == Integrator::kLt ? 65536 : 2048);
  double exact[3];
  for (int c = 0; c < 3; ++c) {
    exact[c] = mean_over_plane(
        s.scene, 0, [&](const Vec3d& p) { return scene.radiance(p, c); }, 2);
    EXPECT_TRUE(mean_is(b.mean(c), exact[c], {.resolution = 0.1, .rounding = 5e-4})) << "channel " << c;
  }
  // The ratio of red to green: noise that is common to both cancels.
  const Estimate ratio = b.of([](const Image& image) {
    double red = 0, green = 0;
    for (size_t i = 0; i < image.data.size(); i += 3) {
      red += image.data[i];
      green += image.data[i + 1];
    }
    return red / green;
  });
  EXPECT_GT(exact[0] / exact[1], 1.1);
  EXPECT_TRUE(mean_is(ratio, exact[0] / exact[1], {.resolution = 0.06, .rounding = 5e-4}));
}

INSTANTIATE_TEST_SUITE_P(All, LightOracle,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
