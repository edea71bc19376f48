#pragma once
// What the workers of a simulated farm hand in: partials of no meaning, which take as many bytes as real
// ones.
#include <random>
#include <string>

#include "common/film/partial.h"
#include "common/job/settings.h"

namespace lightmill {

class SimulatedPartial {
 public:
  explicit SimulatedPartial(const RenderSettings& settings);
  /// The encoded partial of a tile that took so long.
  std::string encode(const TileSpec& tile, double cpu_seconds);

 private:
  void add_splats(const TileSpec& tile);

  const FilmGrid grid_;
  const bool splats_;
  std::mt19937_64 random_{1};
  Partial partial_;  // encoded again and again, for another tile each time
};

}  // namespace lightmill
