#pragma once
// A half of a film's samples, for the AOV `difference`: of an image's noise nothing is known for certain but
// how two independent images differ.
//
// The half is replicate 0 (common/job/replicates.h). Before replicate 1 has begun, with up to 16 spp, it is
// what came before the last power of two, 8 samples of 16: two parts of one low-discrepancy sequence, whose
// errors go against each other a little. So the difference then says rather too much than too little.
//
// With means A of a share a of the samples and B of the others, the image is I = a A + (1 - a) B, and
//
//   D = sqrt(a (1 - a)) (A - B)
//
// has the variance of I, and no correlation with it. So I + D and I - D are uncorrelated, and each has twice
// the variance of I, whatever a is. Splats have a share of their own, that of their light paths.
#include <array>
#include <cstdint>
#include <vector>

#include "common/film/aov_layers.h"
#include "common/film/partial.h"

namespace lightmill {

class ByteReader;
class ByteWriter;

/// The layers of a part of light (GroupSums) in a film, as the film's own. `splat` is empty until one
/// arrives.
struct GroupLayers {
  std::vector<ExactRgb> camera, splat;
};

class HalfFilm {
 public:
  /// The layers of the whole film. All may be empty, except for the cells' samples.
  struct Film {
    const std::vector<ExactRgb>& camera;
    const std::vector<ExactRgb>& splat;
    const AovSums& aovs;
    const std::vector<GroupLayers>& groups;
    const std::vector<int64_t>& cell_samples;
    uint64_t light_paths;
  };
  /// Adds a partial, if it is of this half, to which the film has added it already.
  void fold(const Partial& partial, const Film& film);

  /// A pixel's sums of the half. `pixel`: its index in packet order; `film_pixel`: in film order.
  ExactRgb camera(size_t pixel) const { return at(camera_, pixel); }
  ExactRgb splat(size_t film_pixel) const { return at(splat_, film_pixel); }
  ExactRgb layer(AovLayer layer, size_t pixel) const { return at(layers_[layer], pixel); }
  /// Of light group `group`, one of those that have layers.
  ExactRgb group_camera(size_t group, size_t pixel) const { return at(groups_.at(group).camera, pixel); }
  ExactRgb group_splat(size_t group, size_t film_pixel) const {
    return at(groups_.at(group).splat, film_pixel);
  }
  int64_t samples(size_t cell) const { return cell < cell_samples_.size() ? cell_samples_[cell] : 0; }
  uint64_t light_paths() const { return light_paths_; }

  /// Part of the film's snapshot. `weighted`: AovSpec::weighted. `groups`: how many light groups have layers.
  void write(bool weighted, ByteWriter* out) const;
  void read(ByteReader* in, const FilmGrid& grid, bool weighted, size_t groups);

 private:
  bool holds(const TileSpec& tile) const;
  void add(const Partial& partial, bool subtract);
  static ExactRgb at(const std::vector<ExactRgb>& sums, size_t i) {
    return sums.empty() ? ExactRgb{} : sums[i];
  }

  int64_t half_end_ = 1;  // samples before it are the half; kSuperblockSamples: those of replicate 0 are
  std::vector<ExactRgb> camera_, splat_;
  // Albedo, normal and depth, if they are asked for; weights.
  std::array<std::vector<ExactRgb>, kAovLayers> layers_;
  std::vector<GroupLayers> groups_;
  std::vector<int64_t> cell_samples_;
  uint64_t light_paths_ = 0;
};

}  // namespace lightmill
