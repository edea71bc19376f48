#pragma once
// Random stiff scenes: families with closed answers, drawn, brightened, scaled, turned and moved at random.
//
// All rows of a run together raise a false alarm with a probability that is fixed beforehand
// (kFalseAlarm): the largest |z| that a row may have follows from their number.
#include <cstdint>
#include <vector>

#include "tests/extreme/runner.h"

namespace lightmill::test {

inline constexpr double kFalseAlarm = 1e-3;

/// Scenes `first` to `first` + `count` - 1 of the sequence that `seed` starts. A scene depends on seed and
/// number alone.
std::vector<Case> random_cases(uint64_t seed, int first, int count);
/// pt, bdpt and auto, and lt if it sees all light.
std::vector<Run> random_runs(const Case& subject);
/// The largest |z| of `rows` rows, of three channels each, under kFalseAlarm.
double largest_z(size_t rows);

}  // namespace lightmill::test
