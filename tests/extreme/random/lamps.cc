// One lamp over a floor of which a spot is seen, so small that its light is even.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/extreme/random/families.h"

namespace lightmill::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A floor of half width `half` at y = 0, of which a camera sees the origin and what is within about
/// `around`. A hit is known to 1e-7 of its triangle and of its distance.
float look_at_floor(Draw& d, double half, double around, RandomScene* s) {
  const auto rho = static_cast<float>(d.uniform(0.05, 1));
  s->test.quad({-half, 0, -half}, {0, 0, 2 * half}, {2 * half, 0, 0}, s->test.diffuse(rho));
  // Aslant from where no lamp is in the way.
  const Vec3d eye = normalized({-3, 1.5, -4}) * (2 * half);
  s->test.camera(eye, {0, 0, 0}, 2 * std::atan(around / std::sqrt(dot(eye, eye))) / kDegree).film(8, 8);
  s->max_depth = 1;
  return rho;
}

void set_exact(double value, RandomScene* s) { s->exact = {value, 2 * value, 0.5 * value}; }
Rgb tinted(double x) {
  return {static_cast<float>(x), static_cast<float>(2 * x), static_cast<float>(0.5 * x)};
}

}  // namespace

RandomScene point_over_floor(Draw& d) {
  RandomScene s;
  const double h = d.decades(-2, 1), x = d.coin() ? 0 : h * d.uniform(0, 5);
  const float rho = look_at_floor(d, h, 1e-4 * h, &s);
  s.test.point_light({x, h, 0}, tinted(1));
  set_exact(rho / M_PI * h / std::pow(x * x + h * h, 1.5), &s);
  s.sight = without_lens(delta_light_sight(1, 1));
  s.family = "point over a floor";
  s.said = "height " + text(h) + ", off " + text(x);
  return s;
}

RandomScene spot_over_floor(Draw& d) {
  RandomScene s;
  const double h = d.decades(-1, 1), total = d.decades(-4, 1.9), start = total * d.uniform(0.3, 0.95);
  // The place that is seen is at this angle from the axis: within the even part, or where it falls off.
  const bool falls = d.coin();
  const double angle = falls ? d.uniform(start, total) : start * d.uniform(0, 0.5);
  const double tilt = d.uniform(0, 50) * kDegree;
  const double width = falls ? 1e-4 * (total - start) : 0.1 * start;
  const float rho = look_at_floor(d, h / 2, 0.5 * h * std::min(width * kDegree, 1e-4), &s);
  // From the lamp to the origin, and the axis beside that.
  const Vec3d way{std::sin(tilt), -std::cos(tilt), 0}, across{std::cos(tilt), std::sin(tilt), 0};
  const Vec3d axis = way * std::cos(angle * kDegree) + across * std::sin(angle * kDegree);
  s.test.scene.lights.push_back({SpotLight{tinted(1), way * -h, normalized(axis), start, total}, {}});
  const auto versine = [](double degrees) { return 2 * std::pow(std::sin(degrees * kDegree / 2), 2); };
  const double t =
      std::clamp((versine(total) - versine(angle)) / (versine(total) - versine(start)), 0.0, 1.0);
  set_exact(rho / M_PI * std::cos(tilt) / (h * h) * t * t * (3 - 2 * t), &s);
  s.sight = without_lens(delta_light_sight(1, 1));
  s.family = "spot over a floor";
  s.said = "cone " + text(start) + " to " + text(total) + " degrees, seen at " + text(angle);
  // Directions in float are 1e-7 of a right angle off, over the width of the falling part.
  if (falls) s.oracle_error = std::min(1e-3 + 1e-5 / (total - start), 1.0) / std::max(t * t, 1e-3);
  return s;
}

RandomScene sphere_over_floor(Draw& d) {
  RandomScene s;
  const double r = d.decades(-1, 1), tilt = d.uniform(0, 60) * kDegree;
  const double radius = r * std::min(d.decades(-6, 0), 0.95 * std::cos(tilt));
  const float rho = look_at_floor(d, r, 1e-4 * (r * std::cos(tilt) - radius), &s);
  s.test.sphere({r * std::sin(tilt), r * std::cos(tilt), 0}, radius, s.test.diffuse(0),
                {.radiance = tinted(1)});
  const double q = static_cast<float>(radius) / r;
  set_exact(rho * q * q * std::cos(tilt), &s);
  s.sight = without_lens(area_light_sight(1, 1));
  if (q < 0.01) s.sight.one = kNextEvent;
  s.family = "sphere over a floor";
  s.said = "R/r " + text(q) + ", tilt " + text(tilt / kDegree);
  return s;
}

RandomScene sun_over_floor(Draw& d) {
  RandomScene s;
  const double half = d.coin() ? 0 : d.decades(-4, 1), tilt = d.uniform(0, 75) * kDegree;
  const float rho = look_at_floor(d, 20, 0.1, &s);
  s.test.scene.lights.push_back({DistantLight{tinted(1), {-std::sin(tilt), -std::cos(tilt), 0}, half}, {}});
  set_exact(rho / M_PI * std::cos(tilt), &s);
  s.sight = without_lens(delta_light_sight(1, 1));
  s.family = "sun over a floor";
  s.said = "half angle " + text(half) + ", tilt " + text(tilt / kDegree);
  return s;
}

void hide_lamp(Draw& d, const Vec3d& at, double size, RandomScene* s) {
  const double bright = d.decades(-25, 25);
  const auto value = static_cast<float>(bright);
  const int black = s->test.diffuse(0);
  const bool point = d.coin();
  s->test.sphere(at, size, black);
  if (point) {
    s->test.point_light(at, {value, value, value});
  } else {
    s->test.sphere(at, size / 2, black, {.radiance = {value, value, value}});
  }
  s->said += std::string(", hidden ") + (point ? "point " : "sphere ") + text(bright);
}

}  // namespace lightmill::test
