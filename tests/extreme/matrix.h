#pragma once
// The agreement matrix: every pair of estimators of a scene, a z value each.
//
// For ten scenes without a closed answer: pt, lt, bdpt and every set of strategy families that can see all of
// the scene's light, each with random numbers of its own, against each other by Welch's t of the image's
// mean, turned into the normal deviate of the same probability; the channel that differs most counts.
#include <string>
#include <vector>

#include "tests/extreme/runner.h"

namespace lightmill::test {

struct AgreementMatrix {
  std::string scene;
  std::vector<std::string> runs;
  std::vector<Estimate> means;         // of the first channel, for the reader
  std::vector<std::vector<double>> z;  // z[i][j], j < i
  double worst = 0;                    // largest |z|
  double largest_error = 0;            // relative standard error of the noisiest run
  uint64_t nonfinite = 0;
  bool passed() const;
};

/// Names of the scenes, in order.
std::vector<std::string> matrix_scenes();
/// Renders the runs of scene `index`; `full` takes 16 times the samples.
AgreementMatrix agreement_matrix(size_t index, bool full);
/// Aligned lines: a row per run with its mean and its z against the runs before it.
std::string matrix_text(const AgreementMatrix& matrix);

}  // namespace lightmill::test
