#pragma once
// The AOV layers of a film: folded with its other layers, resolved into channels.
#include <functional>
#include <string>
#include <vector>

#include "common/film/aov_layers.h"
#include "common/film/cryptomatte/matte_film.h"
#include "common/film/halves/half_film.h"
#include "common/film/partial.h"
#include "common/image/image.h"

namespace lightmill {

class ByteReader;
class ByteWriter;

class AovFilm {
 public:
  /// The film's other layers, by pixel of the crop window: the camera's in packet order, splats in film
  /// order.
  struct Colour {
    const std::vector<ExactRgb>& camera;
    const std::vector<ExactRgb>& splat;  // empty without splats
    int quantum_exponent;
    double light_spp;                          // that splats are divided by; 0: none
    std::function<int64_t(int, int)> samples;  // of cell (cx, cy)
    uint64_t light_paths;
  };

  bool empty() const { return sums_.spec.set == 0; }
  /// Throws Error(kFailed), without having changed anything, if the partial has other AOVs than those folded
  /// before. `first`: nothing was folded yet. The partial must have been checked (check_aovs).
  void check(const Partial& partial, bool first) const;
  /// The film's other layers as they are stored.
  struct Whole {
    const std::vector<ExactRgb>& camera;
    const std::vector<ExactRgb>& splat;
    const std::vector<int64_t>& cell_samples;
    uint64_t light_paths;
  };
  /// Adds what check() accepted, and the other layers have already.
  void fold(const Partial& partial, const Whole& whole);
  /// Its channels are aov_channels(set, groups).
  ChannelImage resolve(const FilmGrid& grid, const Colour& colour) const;
  /// The image and its light groups, as Film::light_groups_for_display has them. `holes`: there are cells
  /// without samples.
  ChannelImage light_groups(const FilmGrid& grid, const Colour& colour, bool holes, int block) const;

  /// Part of the film's snapshot.
  void write(ByteWriter* out) const;
  void read(ByteReader* in, const FilmGrid& grid);

 private:
  AovSums
      sums_;  // over the crop window, in packet order; splats, groups and lobes stay empty, they are dense
  std::vector<ExactRgb> direct_splat_;  // crop window, in film order; empty until one arrives
  std::vector<GroupLayers> groups_, lobes_;
  HalfFilm half_;  // for `difference`
  MatteFilm mattes_;
};

}  // namespace lightmill
