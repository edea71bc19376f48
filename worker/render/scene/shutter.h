#pragma once
// A shutter that opens and closes slowly.
#include <vector>

namespace lightmill {

/// Fractions of the exposure by which i / steps of its light has come, i <= steps. `openness` as in
/// ShutterDescription; empty gives none.
std::vector<float> shutter_times(const std::vector<double>& openness, int steps);

}  // namespace lightmill
