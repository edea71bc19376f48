// Thin smooth glass, which light passes straight: closed answers by every estimator that sees the light, and
// the agreement of all sets of strategy families in a room with panes.
//
// alpha = 1e-4 per comparison; `resolution` states the error that a comparison would notice.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/statistical/agreement/strategy_set.h"
#include "tests/statistical/oracles/over_film.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;
constexpr double kEta = 1.5;

/// What a sheet reflects at `cosine`, by the sum over its two faces (pbrt-v4 9.5.3), term by term.
double reflectance(double cosine) {
  const double inside = std::sqrt(1 - (1 - cosine * cosine) / (kEta * kEta));
  const double s = (cosine - kEta * inside) / (cosine + kEta * inside),
               p = (kEta * cosine - inside) / (kEta * cosine + inside);
  const double r = (s * s + p * p) / 2, t = 1 - r;
  double sum = r;
  for (int k = 1; k < 40; ++k) sum += t * t * std::pow(r, 2 * k - 1);
  return sum;
}

class Panes : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
  double resolution(double of_pt) const { return GetParam() == Integrator::kLt ? 3 * of_pt : of_pt; }
};

// A point light on a floor, through none to three panes, one of them tilted. No path hits the light, and none
// that is bent at a pane gets from it to the camera: all comes straight through.
TEST_P(Panes, APointLightShinesThroughThem) {
  for (int panes = 0; panes <= 3; ++panes) {
    SCOPED_TRACE(panes);
    TestScene s;
    s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(0.6f));
    const int glass = s.thin_dielectric(static_cast<float>(kEta));
    const Vec3d tilt = normalized({0.3, 1, 0.1});
    if (panes > 0) s.quad({-4, 1.2, -4}, {0, 0, 8}, {8, 0, 0}, glass);
    if (panes > 1) s.quad({-4, 1.4, -4}, {8, 0, 0}, {0, 0, 8}, glass);
    if (panes > 2) {
      const Vec3d u = normalized(cross({0, 0, 1}, tilt)) * 8, v = normalized(cross(tilt, u)) * 8;
      s.quad(Vec3d{0, 2.6, 0} - u * 0.5 - v * 0.5, u, v, glass);
    }
    const Vec3d light{0.4, 4, 0.2};
    s.point_light(light, {10, 10, 10});
    s.camera({0, 0.8, -1.5}, {0.3, 0, 0.4}, 25).film(8, 8);
    const Batches image = render(s, 1, GetParam() == Integrator::kLt ? 16384 : 256);
    const double exact = over_film(s, [&](const Vec3d& w) {
      const Vec3d eye = camera_position(s.scene), p = eye + w * (-eye.y / w.y), to = light - p;
      const Vec3d d = normalized(to);
      const double flat = 1 - reflectance(d.y), tilted = 1 - reflectance(std::abs(dot(d, tilt)));
      const double through = panes == 0 ? 1 : panes == 1 ? flat : flat * flat * (panes == 3 ? tilted : 1);
      return 0.6 / M_PI * 10 * d.y / dot(to, to) * through;
    });
    EXPECT_TRUE(mean_is(image.mean(0), exact, {.resolution = resolution(0.02), .rounding = 1e-4}));
  }
}

// What a pane reflects, of a wall that shines.
TEST_P(Panes, ReflectWhatTheyDoNotLetThrough) {
  TestScene s;
  const Vec3d normal = normalized({0, 1, -1});
  s.quad({-2, -2, 0}, {0, 4, 4}, {4, 0, 0}, s.thin_dielectric(static_cast<float>(kEta)));
  s.quad({-9, 4, -9}, {18, 0, 0}, {0, 0, 18}, s.diffuse(0), {.radiance = {1, 1, 1}, .two_sided = true});
  s.camera({0, 0, -1}, {0, 0, 2}, 20).film(8, 8);
  const Batches image = render(s, 2, 2048);
  const double exact = over_film(s, [&](const Vec3d& w) { return reflectance(std::abs(dot(w, normal))); });
  if (GetParam() == Integrator::kLt) {
    EXPECT_EQ(image.mean(0).mean, 0) << "no path from the wall can be joined to the camera by a mirror";
    return;
  }
  EXPECT_TRUE(mean_is(image.mean(0), exact, {.resolution = 0.1, .rounding = 1e-4}));
}

// In a closed box that shines it is equally bright everywhere, whatever panes are in it.
TEST_P(Panes, LoseNothing) {
  if (GetParam() == Integrator::kLt) return;  // it does not see mirror images
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0), {.radiance = {1, 1, 1}, .inward = true});
  const int glass = s.thin_dielectric(static_cast<float>(kEta));
  s.sphere({0.2, 0.1, 0.4}, 0.4, glass);
  s.sphere({0.2, 0.1, 0.4}, 0.2, s.mix(glass, s.diffuse(1), 0.3f));
  s.quad({-1, -0.5, 0}, {2, 0, 0}, {0, 1, 0.3}, glass);
  s.camera({0, 0, -0.8}, {0.1, 0, 1}, 60).film(8, 8);
  const Batches image = render(s, kUnlimitedDepth, 256);
  EXPECT_TRUE(mean_is(image.mean(0), 1, {.resolution = 0.05, .rounding = 1e-4}));
}

/// A dark room under an even sky that comes in by a glazed hole of its ceiling.
TestScene room_with_a_skylight(bool portal) {
  TestScene s;
  const int wall = s.diffuse(0.5f), glass = s.thin_dielectric(static_cast<float>(kEta));
  s.quad({-1, 0, -1}, {2, 0, 0}, {0, 0, 2}, wall);
  for (const double side : {-1.0, 1.0}) {
    s.quad({side, 0, -1}, {0, 0, 2}, {0, 1, 0}, wall).quad({-1, 0, side}, {2, 0, 0}, {0, 1, 0}, wall);
    s.quad({side, 1, -1}, {-0.6 * side, 0, 0}, {0, 0, 2}, wall);
    s.quad({-0.4, 1, side}, {0.8, 0, 0}, {0, 0, -0.6 * side}, wall);
  }
  s.quad({-0.4, 1, -0.4}, {0.8, 0, 0}, {0, 0, 0.8}, glass);
  InfiniteLight sky{{1, 1, 1}};  // the portal opens upwards
  if (portal) sky.portal = {{{-0.4, 1, -0.4}, {0.4, 1, -0.4}, {0.4, 1, 0.4}, {-0.4, 1, 0.4}}};
  s.scene.lights.push_back({sky, {}});
  return s.camera({0, 0.5, -0.9}, {0, 0.3, 1}, 80).film(8, 8);
}

// A portal says where the sky is seen from: from where the segment began, not from the pane that it crossed.
TEST_P(Panes, LieInPortals) {
  const int64_t spp = GetParam() == Integrator::kLt ? 16384 : 1024;  // few of its paths come in unled
  const Batches with = render(room_with_a_skylight(true), 4, spp),
                without = render(room_with_a_skylight(false), 4, spp);
  EXPECT_TRUE(means_agree(with.mean(0), without.mean(0), {.resolution = 0.1, .rounding = 1e-4}));
}

/// The room with a pane across it, a bubble around its lamp's light and a ball in a bubble.
TestScene room_with_panes() {
  TestScene s = cornell_room();
  const int glass = s.thin_dielectric(static_cast<float>(kEta));
  s.quad({-1, -1, -0.2}, {2, 0, 0}, {0, 2, 0.1}, glass);
  s.sphere({-0.35, -0.4, 0.3}, 0.35, glass);
  s.sphere({-0.35, -0.4, 0.3}, 0.2, s.diffuse(0.7f));
  s.sphere({0.5, 0.2, 0.2}, 0.25, s.mix(glass, s.diffuse(0.8f), 0.5f));
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(16, 16);  // the lamp is out of sight
  return s;
}

/// Those that see what panes reflect, which is a delta: hits, alone and with any others.
class PaneStrategySet : public ::testing::TestWithParam<unsigned> {};

TEST_P(PaneStrategySet, AgreesInARoom) {
  expect_agrees_with_all(room_with_panes(), GetParam(),
                         {.max_depth = 5,
                          .spp = 768,
                          .weak_spp = 4096,
                          .once_spp = 512,
                          .notice = 1.1f,
                          .connections_notice = 1.25f});
}

// The same in fog, where the segments' other terms are not 1.
TEST(PanesInFog, PathTracingAndBdptAgree) {
  TestScene s = room_with_panes();
  s.scene.media.push_back({"", {0.05f, 0.05f, 0.1f}, {0.4f, 0.3f, 0.2f}, {}, 0.3f, {}});
  for (ShapeDescription& shape : s.scene.shapes) shape.media = {0, 0};
  s.scene.camera.medium = 0;
  const auto mean_by = [&](Integrator i, int64_t spp) {
    return render_batches(s.scene, settings_for(s.scene, i, spp, 4), kBatches).mean(0);
  };
  const auto pt = mean_by(Integrator::kPt, 1024), bdpt = mean_by(Integrator::kBdpt, 256);
  EXPECT_TRUE(means_agree(pt, bdpt, {.resolution = 0.05, .rounding = 1e-4}));
}

INSTANTIATE_TEST_SUITE_P(All, Panes, ::testing::Values(Integrator::kPt, Integrator::kLt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, PaneStrategySet,
                         ::testing::Range<unsigned>(kEmissionHits, kAllStrategies + 1, 2), set_name);

}  // namespace
}  // namespace lightmill::test
