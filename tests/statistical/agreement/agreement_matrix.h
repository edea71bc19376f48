#pragma once
// The agreement of strategies: every pair of estimators of the paths of one length, a z value each.
//
// The estimators of paths of k vertices (light and lens included) are the k strategies (s,t), s + t = k, each
// alone (unweighted, as `lightmill render --diagnose` takes them from one bdpt render), and what pt, lt and
// bdpt, weights and all, add to paths of that length, each from a render of its own. An estimator takes part
// where it can make all such paths; that follows from what the scene declares to hold (`Sight`), never from
// what was measured.
//
// Blocks of 8x8 pixels (the whole image for paths of five and more vertices) are compared per channel: the
// difference of two estimators in 16 batches with seeds of their own, Student's t (strategies of one render
// are correlated, so pairs of batches are what is independent). The family of all tests of all scenes has
// level kFamilyAlpha (Bonferroni). A block where the difference is noisier than kNoisiest holds too few paths
// for t to mean anything and is not judged; every estimator must be judged somewhere.
#include <cstdint>
#include <string>
#include <vector>

#include "common/image/image.h"

namespace lightmill::test {

inline constexpr double kFamilyAlpha = 1e-3;
/// Largest standard error of a difference, relative to the mean.
inline constexpr double kNoisiest = 0.07;

/// What a scene holds, as far as it blinds strategies.
struct Sight {
  bool delta_surfaces = false;  // no connection to or from them: vertices are joined with a density of 0
  bool delta_lights = false;    // points and directions: can't be hit, nor be seen directly
  bool far_lights = false;      // beyond the scene: have no place whose image the lens could connect to
  /// (s,t) can make every path of s + t vertices. A path of two vertices shows the light itself.
  bool seen_by(int s, int t) const;
  /// The paths of `k` vertices exist.
  bool has(int k) const { return k > 2 || !delta_lights; }
};

struct MatrixScene {
  std::string name;  // of the file below tests/statistical/agreement
  int max_depth;     // scattering events
  Sight sight;
  int64_t times_spp = 1;  // more where joined vertices lie so near each other that few samples say little
};
const std::vector<MatrixScene>& matrix_scenes();

/// One estimator of paths of one length.
struct Estimator {
  std::string name;
  std::vector<std::vector<double>> batches;  // [batch][block * 3 + channel]: mean radiance
  Image picture;                             // mean over batches
};
/// All estimators of the paths of `vertices` vertices.
struct PathLength {
  int vertices = 0;
  std::vector<Estimator> estimators;
};
struct SceneEstimates {
  MatrixScene scene;
  std::vector<PathLength> lengths;
  uint64_t nonfinite = 0;
};
/// Renders `scene` by pt, lt and bdpt with `spp` samples per pixel and batch, times MatrixScene::times_spp.
SceneEstimates estimate_scene(const MatrixScene& scene, int64_t spp);

/// Of two estimators: the block and channel that differ most.
struct Cell {
  double z = 0;      // normal deviate of the same probability as Student's t
  double noise = 0;  // standard error of the difference there over the mean
};
struct Matrix {
  int vertices = 0;
  std::vector<std::vector<Cell>> cells;  // [i][j], j < i
  /// Per estimator: the smallest relative error, alike in all blocks, that its comparison with the least
  /// noisy other estimator would find at the family's level.
  std::vector<double> notices;
};
/// Tests in `length`, for the family.
int64_t tests_in(const PathLength& length);
/// `level` is that of one test.
Matrix compare(const PathLength& length, double level);
/// |z| that a test of probability `level` reaches.
double largest_z(double level);
/// `length` with estimator `i` multiplied by `factor`: to show that a comparison can fail.
PathLength scaled(const PathLength& length, size_t i, double factor);

/// Aligned lines: a row per estimator with its z against those before it.
std::string matrix_text(const PathLength& length, const Matrix& matrix, double worst_allowed);
/// A page with a table and the estimators' pictures per scene and length.
std::string matrix_html(const std::vector<SceneEstimates>& scenes, double level);
std::string matrix_json(const std::vector<SceneEstimates>& scenes, double level);

}  // namespace lightmill::test
