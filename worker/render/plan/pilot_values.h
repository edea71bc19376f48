#pragma once
// The values of pixels, from a pilot's first pass. In its second pass the variance of the same samples is
// weighed by them.
#include <array>
#include <vector>

#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/pilot_pixels.h"
#include "worker/render/plan/relative_weights.h"

namespace lightmill {

/// What the samples of one cell contribute.
struct CellPreview {
  struct Splat {
    uint32_t pixel;
    Channels rgb;
    float per_hit;  // s = t = 1: times likelier than by a camera path; else 0
  };
  std::vector<Channels> pixels = std::vector<Channels>(kCellPixels);  // camera layer, row-major
  std::vector<Splat> splats;                                          // anywhere on the film
  uint64_t light_paths = 0;

  void add(const std::vector<StrategyContribution>& contributions, uint64_t more_light_paths);
};

class PilotValues {
 public:
  PilotValues(const FilmGrid& grid, const PilotPixels& pilot_pixels);
  /// Takes cell number `i` of the pilot pixels: each cell once, from any thread.
  void take(size_t i, CellPreview preview);
  /// To be called after all cells.
  void finish();
  /// The value of any pixel: of a square of pixels of which some are pilot pixels.
  PixelValue of(int x, int y) const;
  /// The same for pixel number `pixel` of the film, row-major.
  PixelValue of(uint32_t pixel) const {
    const auto width = static_cast<uint32_t>(grid_.width);
    return of(static_cast<int>(pixel % width), static_cast<int>(pixel / width));
  }
  /// Values of the pilot pixels of cell number `i`, row-major.
  std::array<PixelValue, kCellPixels> of_cell(size_t i) const;

 private:
  struct Cell {
    std::vector<Channels> seen;  // sums of the camera paths of each of for_seen()
    std::vector<CellPreview::Splat> splats;
    uint64_t light_paths = 0;
  };
  /// Light of a visible emitter, by light tracing.
  struct Emission {
    uint32_t pixel;
    Channels rgb;
  };
  template <class F>
  void for_pixels(size_t i, F&& f) const;
  template <class F>
  void for_seen(size_t i, F&& f) const;
  void add_splats(const std::vector<CellPreview::Splat>& splats);
  void add_emission(int x, int y, PixelValue* value) const;

  /// This many splats of a pixel that an emitter covers are enough to tell which part of other pixels it
  /// covers. Then they count for the pixel alone and not for its square.
  static constexpr float kEnoughSplats = 16;

  const FilmGrid& grid_;
  const PilotPixels& pilot_pixels_;
  RelativeWeights weights_;
  double per_splat_ = 0;  // what one adds to a pixel's value: many light paths are one per unit of spp
  std::vector<Cell> cells_;
  std::vector<Emission> emission_;  // by rising pixel
};

}  // namespace lightmill
