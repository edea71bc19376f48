#pragma once
// Random scenes with closed answers: the numbers that they are drawn from, and where they are put.
#include <cstdint>
#include <random>

#include "tests/extreme/case.h"

namespace lightmill::test {

/// Random numbers that are the same with every standard library.
class Draw {
 public:
  explicit Draw(uint64_t seed) : generator_(seed) {}
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  /// Even over the logarithm: 10^lo to 10^hi.
  double decades(double lo, double hi);
  int below(int n) { return static_cast<int>(uniform(0, n)); }
  bool coin() { return below(2) == 0; }
  Vec3d direction();

 private:
  std::mt19937_64 generator_;
};

/// A scene that was drawn. `said`: what was drawn, for people.
struct RandomScene {
  TestScene test;
  int max_depth = 1;
  std::array<double, 3> exact{};
  Sight sight;
  std::string family, said;
  double oracle_error = 1e-4;
};

/// Multiplies all light by `factor`.
void brighten(double factor, RandomScene* scene);
/// Makes the scene `scale` times as large, turns it about `axis` and moves it; the picture stays the same.
void place(double scale, double degrees, const Vec3d& axis, const Vec3d& by, SceneDescription* scene);

}  // namespace lightmill::test
