// Photons that come by a mirror know how their direction changes with their place: as that to the light's
// image.
#include "worker/render/guiding/training/photon_tracing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A floor and a mirror behind it.
TestScene floor_and_mirror() {
  TestScene s;
  s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.6f));
  s.quad({-1, 0, 1}, {0, 1, 0}, {2, 0, 0}, s.conductor(0.9f, 0));
  s.camera({0, 0.6, -1}, {0, 0, 0.5}, 40).film(16, 16);
  return s;
}

std::vector<Photon> photons_of(const TestScene& s) {
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 5), 1);
  std::vector<Photon> photons;
  for (size_t i = 0; i < 64; ++i) {
    const std::vector<Photon> more = photons_of_wavefront(renderer.context(), i, PhotonUse::kGuide);
    photons.insert(photons.end(), more.begin(), more.end());
  }
  return photons;
}

TEST(PhotonTracing, TurnsToTheImageOfALamp) {
  TestScene s = floor_and_mirror();
  s.quad({-0.05, 0.8, 0.2}, {0.1, 0, 0}, {0, 0.1, 0}, s.diffuse(0), {.radiance = {1, 1, 1}});
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 5), 1);
  const RenderScene& scene = renderer.context().scene;
  const Vec3d image = scene.normalised_point({0, 0.85, 1.8}), beside = scene.normalised_point({0, 0.85, 2.8});
  const double unit = length(beside - image);
  const std::vector<Photon> photons = photons_of(s);
  ASSERT_GT(photons.size(), 1000u);
  size_t close = 0;
  for (const Photon& p : photons) {
    const std::array<double, 3> w{double{p.w.x}, double{p.w.y}, double{p.w.z}};
    // All of the lamp has about the same distance along the mirror's normal.
    const Vec3d at{double{p.p.x}, double{p.p.y}, double{p.p.z}};
    const double distance = (image.z - at.z) / w[2];
    double error = 0;
    for (size_t row = 0; row < 3; ++row) {
      for (size_t k = 0; k < 3; ++k) {
        const double expected = (w[row] * w[k] - (row == k ? 1 : 0)) / distance;
        error = std::max(error, std::fabs(double{p.turn[3 * row + k]} - expected));
      }
    }
    close += error < 0.01 / unit;
  }
  EXPECT_GT(close, photons.size() * 98 / 100) << "but at the floor's edge";
}

// What comes from one point of the sky comes from the same direction everywhere.
TEST(PhotonTracing, DoesNotTurnToAnInfiniteLight) {
  TestScene s = floor_and_mirror();
  s.environment({1, 1, 1});
  const std::vector<Photon> photons = photons_of(s);
  ASSERT_GT(photons.size(), 100u);
  for (const Photon& p : photons) {
    for (const float t : p.turn) EXPECT_LT(std::fabs(t), 0.01f);
  }
}

}  // namespace
}  // namespace lightmill::test
