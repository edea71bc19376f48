#pragma once
// The film: a job's merged layers. Folding is associative and commutative, bit for bit.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/film/aov_film.h"
#include "common/film/partial.h"
#include "common/image/image.h"

namespace lightmill {

class Film {
 public:
  Film() = default;
  explicit Film(const FilmGrid& grid);
  /// Adds a committed partial. Throws Error(kFailed) if its grid or quantum differ from the film's.
  void fold(const Partial& partial);
  /// The current image over the crop window: camera sums / samples of the pixel's cell + splat sums /
  /// (light paths / light_paths_per_spp). Pixels without samples are 0. Linear Rec.709, float.
  Image resolve() const;
  /// The same, to look at while tiles are missing: pixels without camera samples take those around them.
  Image resolve_for_display() const;
  /// The mean of the magnitudes of resolve()'s values.
  double mean_magnitude() const;
  /// The AOVs that the job asked for, over the crop window; without channels if it asked for none.
  ChannelImage resolve_aovs() const;
  /// What a light mix is made of, to look at: R, G, B of the image and of each light group, with the names of
  /// resolve_aovs(). A pixel is the mean of `block` >= 1 by `block` pixels of the film; what has no camera
  /// samples yet takes those around it, in the image and the groups alike. So groups add up to the image.
  /// Without channels if there are no groups.
  ChannelImage light_groups_for_display(int block) const;
  const FilmGrid& grid() const { return grid_; }
  /// Samples per pixel of the camera layer of cell (cx, cy).
  int64_t cell_samples(int cx, int cy) const;
  uint64_t light_paths() const { return light_paths_; }
  const RenderCounters& counters() const { return counters_; }
  double cpu_seconds() const { return cpu_seconds_; }

  /// Compressed snapshot of everything above; `restore` throws Error(kFailed) on corruption.
  std::string snapshot() const;
  static Film restore(std::string_view bytes);

 private:
  Image resolve(bool with_camera, bool with_splats) const;
  bool has_holes() const;
  AovFilm::Colour colour() const;

  FilmGrid grid_;
  bool has_quantum_ = false;
  int quantum_exponent_ = 0;
  std::vector<ExactRgb> camera_;       // crop window, row-major, in packet order (pixel_interleave.h)
  std::vector<int64_t> cell_samples_;  // grid_.cells(), row-major
  std::vector<ExactRgb> splat_;        // crop window, row-major, in film order; empty until a splat arrives
  AovFilm aovs_;
  uint64_t light_paths_ = 0;
  RenderCounters counters_;
  double cpu_seconds_ = 0;
};

}  // namespace lightmill
