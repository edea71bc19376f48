// Homogeneous media: Beer and Lambert's law, furnaces in which nothing is absorbed, and single scattering.
#include <cmath>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

int add_medium(TestScene* s, float sigma_a, float sigma_s, float g = 0) {
  s->scene.media.push_back({"", {sigma_a, sigma_a, sigma_a}, {sigma_s, sigma_s, sigma_s}, {}, g, {}});
  return static_cast<int>(s->scene.media.size()) - 1;
}

/// Of what has not scattered, through a slab of thickness 1 that a parallel view crosses straight.
Case slab(float depth, bool scatters) {
  Case c{"18 slab of a medium", "optical depth " + text(depth) + (scatters ? ", scattering" : ", absorbing"),
         "L exp(-depth)", area_light_sight(0, 0), [depth, scatters] {
           TestScene s;
           s.quad({-2, -2, 2}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0), {.radiance = {1, 2, 3}});
           const size_t first = s.scene.shapes.size();
           s.box({-3, -3, 0.5}, {3, 3, 1.5}, s.diffuse(0));
           const int medium = add_medium(&s, scatters ? 0 : depth, scatters ? depth : 0);
           for (size_t i = first; i < s.scene.shapes.size(); ++i) {
             s.scene.shapes[i].media = {medium, -1};
             s.scene.shapes[i].boundary = true;
           }
           s.camera({0, 0, 0}, {0, 0, 1}, 90).film(16, 16);
           s.scene.camera.kind = CameraKind::kOrthographic;
           const double t = std::exp(-double{depth});
           return Setup{s.scene, 0, {t, 2 * t, 3 * t}};
         }};
  c.every_set = true;
  return c;
}

/// An emitting black box full of a medium that absorbs nothing.
Case furnace(float depth, float g) {
  Case c{"19 furnace with a medium", "optical depth " + text(depth) + ", g " + text(g), "L",
         area_light_sight(0, kUnlimitedDepth), [depth, g] {
           TestScene s;
           s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0), {.radiance = {1, 0.5f, 2}, .inward = true});
           const int medium = add_medium(&s, 0, depth / 2, g);
           for (ShapeDescription& shape : s.scene.shapes) shape.media = {medium, medium};
           s.scene.camera.medium = medium;
           s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 90).film(16, 16);
           return Setup{s.scene, kUnlimitedDepth, {1, 0.5, 2}, 1e-4};
         }};
  c.pt_only = depth > 4;
  if (depth > 4) {
    c.notes.push_back({Note::kSkip, kNextEvent, "hundreds of events per path"});
    c.notes.push_back({Note::kSkip, kEmissionHits | kNextEvent, "hundreds of events per light path"});
    c.notes.push_back({Note::kSkip, kEmissionHits, "light that the medium all but hides from every event"});
  }
  if (depth <= 4) {
    c.notes.push_back({Note::kSkip, kEmissionHits | kNextEvent,
                       "light paths that scatter next to the lens have infinite variance"});
  }
  return c;
}

/// A ball of a medium that absorbs nothing under an even sky, behind a boundary: it is not to be seen.
Case ball(float depth, float g) {
  Case c{"20 ball of a medium under a sky", "optical depth " + text(depth) + ", g " + text(g), "L0",
         far_light_sight(0, kUnlimitedDepth), [depth, g] {
           TestScene s;
           s.sphere({0, 0, 0}, 0.5, s.diffuse(0));
           s.scene.shapes[0].media = {add_medium(&s, 0, depth, g), -1};
           s.scene.shapes[0].boundary = true;
           s.environment({1, 0.5f, 2}).camera({0.4, 0.9, -3}, {0, 0, 0}, 22).film(16, 16);
           return Setup{s.scene, kUnlimitedDepth, {1, 0.5, 2}, 1e-4};
         }};
  c.pt_only = depth > 4;
  if (depth > 4) c.notes.push_back({Note::kSkip, kNextEvent, "hundreds of events per path"});
  return c;
}

/// What a point light of intensity 1 at distance h from a ray, a way `along` it, scatters into it up to
/// `end`: Simpson's rule over the angle at the light.
double scattered_into_ray(double sigma, double g, double h, double along, double end) {
  const auto in_angle = [&](double a) {
    const double x = along + h * std::tan(a), d = h / std::cos(a), cosine = -std::sin(a);
    return (1 - g * g) / (4 * M_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5)) * std::exp(-sigma * (x + d)) /
           h;
  };
  const double a0 = std::atan(-along / h), a1 = std::atan((end - along) / h);
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i)
    sum += in_angle(a0 + (a1 - a0) * i / kSteps) * (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2);
  return sigma * sum * (a1 - a0) / (3 * kSteps);
}

/// A line of sight in a medium that passes a point light between black walls.
Case single_scattering(float sigma, float g) {
  Case c{"21 single scattering", "sigma " + text(sigma) + ", g " + text(g), "quadrature along the ray",
         without_lens(delta_light_sight(1, 1)), [sigma, g] {
           TestScene s;
           s.box({-1, -1, -1}, {1, 1, 3}, s.diffuse(0), {.inward = true});
           const int medium = add_medium(&s, 0, sigma, g);
           s.scene.camera.medium = medium;
           s.point_light({0.6, 0, 1.5}, {1, 1, 1});
           s.scene.lights.back().medium = medium;
           s.camera({0, 0, 0}, {0, 0, 1}, 0.01).film(16, 16);
           return Setup{s.scene, 1, grey(scattered_into_ray(double{sigma}, double{g}, 0.6, 1.5, 3)), 1e-3};
         }};
  if (sigma > 1 && g < -0.9f)
    c.notes.push_back({Note::kNoisy, 0, "what turns back is seen from afar alone, through the medium"});
  return c;
}

}  // namespace

std::vector<Case> media_cases() {
  std::vector<Case> cases;
  // What is left of 16 is still a thousand steps of the film's sums.
  for (const float depth : {1e-6f, 1e-3f, 1.0f, 16.0f}) cases.push_back(slab(depth, false));
  for (const float depth : {1e-6f, 1e-3f, 1.0f, 4.0f}) cases.push_back(slab(depth, true));
  for (const float depth : {1e-6f, 1.0f, 50.0f}) {
    for (const float g : {-0.99f, 0.0f, 0.99f}) {
      cases.push_back(furnace(depth, g));
      cases.push_back(ball(depth, g));
    }
  }
  for (const float sigma : {0.01f, 1.0f, 5.0f}) {
    for (const float g : {-0.99f, 0.0f, 0.9f, 0.99f}) cases.push_back(single_scattering(sigma, g));
  }
  return cases;
}

}  // namespace lightmill::test
