#pragma once
// What a test expects of an image as a whole: the mean of a known function of direction.
#include "tests/support/test_scene.h"

namespace lightmill::test {

/// Mean of f(direction) over the film of `s`.
template <class F>
double over_film(const TestScene& s, F&& f) {
  constexpr int kSteps = 64;
  double sum = 0;
  for (int y = 0; y < kSteps; ++y) {
    for (int x = 0; x < kSteps; ++x) {
      sum += f(camera_direction(s.scene, s.scene.film.width * (x + 0.5) / kSteps,
                                s.scene.film.height * (y + 0.5) / kSteps));
    }
  }
  return sum / (kSteps * kSteps);
}

}  // namespace lightmill::test
