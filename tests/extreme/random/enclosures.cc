// Everything encloses everything, or all that is seen reflects one radiance.
#include <cmath>

#include "tests/extreme/random/families.h"
#include "tests/extreme/solids.h"

namespace lightmill::test {
namespace {

/// Adds a convex shape; returns the radius of a sphere within it.
double add_any_solid(Draw& d, RandomScene* s, int material, const Emits& emits) {
  const auto solid = static_cast<Solid>(d.below(kSolids));
  const int rings = 4 + d.below(29);
  s->said = std::string(solid_name(solid)) + " of " + std::to_string(rings);
  return add_solid(&s->test, solid, rings, material, emits);
}

}  // namespace

RandomScene closed_emitter(Draw& d) {
  RandomScene s;
  const auto rho = static_cast<float>(d.coin() ? d.uniform(0, 0.9) : 0);
  s.max_depth = d.coin() ? d.below(6) : 30;
  const double inner = add_any_solid(d, &s, s.test.diffuse(rho), {.radiance = {1, 0.5f, 2}, .inward = true});
  const Vec3d eye = d.direction() * (d.uniform(0, 0.8) * inner);
  s.test.camera(eye, eye + d.direction(), d.uniform(10, 90)).film(16, 16);
  const double r = double{rho}, sum = (1 - std::pow(r, s.max_depth + 1)) / (1 - r);
  s.exact = {sum, 0.5 * sum, 2 * sum};
  s.sight = area_light_sight(0, s.max_depth);
  s.family = "closed emitter";
  s.said += ", rho " + text(rho) + ", depth " + std::to_string(s.max_depth);
  return s;
}

RandomScene emitting_bowl(Draw& d) {
  RandomScene s;
  const auto rho = static_cast<float>(d.uniform(0.1, 1));
  const double top = d.uniform(-0.9, 0.9);
  add_bowl(&s.test, top, 128, s.test.diffuse(rho), {.radiance = {1, 0.5f, 2}, .inward = true});
  s.max_depth = d.below(30);
  // The bowl's ground fills the view.
  s.test.camera({0, 0, -0.5}, {0, 0, -1}, 40).film(16, 16);
  const double f = double{rho} * (top + 1) / 2, sum = (1 - std::pow(f, s.max_depth + 1)) / (1 - f);
  s.exact = {sum, 0.5 * sum, 2 * sum};
  s.sight = area_light_sight(0, s.max_depth);
  s.family = "emitting bowl";
  s.said = "up to z " + text(top) + ", rho " + text(rho) + ", depth " + std::to_string(s.max_depth);
  s.oracle_error = 2e-3;  // its facets
  return s;
}

RandomScene convex_in_sky(Draw& d) {
  RandomScene s;
  const auto rho = static_cast<float>(d.uniform(0, 1));
  const bool emits = d.coin();
  const auto glow = static_cast<float>(emits ? d.decades(-2, 2) : 0);
  const double inner = add_any_solid(d, &s, s.test.diffuse(rho), {.radiance = {glow, glow, glow}});
  const double away = d.decades(0.5, 3);
  s.test.camera(d.direction() * away, {0, 0, 0}, 2 * std::atan(0.4 * inner / away) * 180 / M_PI).film(16, 16);
  s.test.environment({1, 2, 0.5f});
  s.max_depth = 3;
  for (size_t c = 0; c < 3; ++c) s.exact[c] = double{glow} + double{rho} * std::array{1.0, 2.0, 0.5}[c];
  s.sight = without_lens(emits ? area_light_sight(0, 1) : far_light_sight(1, 1));
  s.family = "convex in a sky";
  s.said += ", rho " + text(rho) + ", Le " + text(glow);
  return s;
}

RandomScene glass_in_sky(Draw& d) {
  RandomScene s;
  const int blocks = 1 + d.below(3);
  double x = -1;
  for (int i = 0; i < blocks; ++i) {
    const double wide = d.uniform(0.2, 1), high = d.coin() ? 1 : d.uniform(0.5, 1.5);
    s.test.box({x, -high, -1}, {x + wide, high, 1},
               s.test.dielectric(static_cast<float>(d.uniform(1.1, 2)), 0));
    x += wide + (d.coin() ? 0 : 0.1);
  }
  s.test.environment({1, 2, 0.5f});
  s.test.camera(d.direction() * 6, {-0.5, 0, 0}, 20).film(16, 16);
  s.max_depth = kUnlimitedDepth;
  s.exact = {1, 2, 0.5};
  s.sight = specular_sight();
  s.family = "glass in a sky";
  s.said = std::to_string(blocks) + " blocks";
  s.oracle_error = 1e-3;
  return s;
}

}  // namespace lightmill::test
