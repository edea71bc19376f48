#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {

TestScene triangle_light(bool two_sided) {
  TestScene s;
  s.triangle({-0.5, 1.0, 0.2}, {0.7, 1.3, -0.4}, {0.1, 0.8, 0.9}, s.diffuse(0),
             {.radiance = {2, 1, 0.5f}, .two_sided = two_sided});
  return s;
}

TestScene sphere_light(double radius, double distance) {
  TestScene s;
  s.sphere({0, 0, distance}, radius, s.diffuse(0), {.radiance = {1, 1, 1}});
  return s;
}

TestScene mixed_lights() {
  TestScene s;
  const int black = s.diffuse(0);
  s.triangle({-1, 2, 0}, {1, 2, 0}, {0, 2, 1}, black, {.radiance = {1, 1, 1}});
  s.triangle({-1, 2, 0}, {1, 2, 0}, {0, 3, 1}, black, {.radiance = {1e-4f, 1e-4f, 1e-4f}});
  s.sphere({0, 0, 3}, 0.5, black, {.radiance = {5, 0, 0}});
  s.sphere({3, 0, 0}, 0.01, black, {.radiance = {1000, 1000, 1000}});
  s.point_light({0, -1, 0}, {0.3f, 0.2f, 0.1f}).environment({0.01f, 0.02f, 0.03f});
  return s;
}

}  // namespace lightmill::test
