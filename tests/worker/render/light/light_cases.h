#pragma once
// Light tables made by the scene builder from scenes in code. The camera sits at the origin and the extent is
// a power of two, so that normalised space is a known power of two of scene space.
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {

struct LightScene {
  RenderScene scene;
  double scale;  // normalised length of one scene unit
  explicit LightScene(const TestScene& s)
      : scene(build_scene(s.scene)), scale(std::ldexp(1.0, scene.scale_exponent)) {}
  const LightTable& lights() const { return scene.lights; }
  Vec3<float> at(double x, double y, double z) const {
    return {static_cast<float>(x * scale), static_cast<float>(y * scale), static_cast<float>(z * scale)};
  }
};

/// One light of each kind.
TestScene triangle_light(bool two_sided = false);
TestScene sphere_light(double radius, double distance);
/// All kinds at once, powers over many decades.
TestScene mixed_lights();

/// Mean of `value` over `n` calls in 32 batches.
template <class Fn>
Estimate mean_of(int n, Fn&& value) {
  std::vector<double> batches(32);
  for (double& b : batches) {
    for (int i = 0; i < n / 32; ++i) b += value() / (n / 32);
  }
  return estimate(batches);
}

}  // namespace lightmill::test
