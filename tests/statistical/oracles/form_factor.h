#pragma once
// Irradiance integrals in double, for oracles.
#include <functional>
#include <vector>

#include "tests/support/test_scene.h"

namespace lightmill::test {

/// Irradiance at `x` with unit normal `n` from a polygon of constant radiance 1, all of it above the horizon:
/// Lambert's formula, E = 1/2 sum_i Theta_i (Gamma_i . n). The vertices go counter-clockwise as seen from `x`
/// or clockwise: the result is positive.
double polygon_irradiance(const std::vector<Vec3d>& vertices, const Vec3d& x, const Vec3d& n);

/// Mean over the film of `radiance(p)` where p is what the pixel sees on the plane y = height; `samples`
/// midpoints per pixel side.
double mean_over_plane(const SceneDescription& scene, double height,
                       const std::function<double(const Vec3d&)>& radiance, int samples = 16);

}  // namespace lightmill::test
