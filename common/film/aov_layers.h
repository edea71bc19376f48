#pragma once
// The exact sums behind AOVs (common/job/aovs.h): beside the camera layer, over the same pixels and samples.
//
// Every camera sample adds one rounded integer per channel. So these layers merge like the camera layer: in
// any order, to the same bits. Values that are not radiance have fixed steps. Signed ones get a bias that
// makes them positive; at the end it is subtracted, times the number of samples. All saturate rather than
// being dropped, so no AOV changes what is counted.
//
//   layer     channels                  step                     added for
//   albedo    RGB                       2^-30                    every sample
//   normal    XYZ + 2^31 steps          2^-30                    every sample
//   position  XYZ + 2^52 steps          2^-32 normalised units   samples that hit something
//   depth     distance, hits, unused    2^-32 normalised units   samples that hit something
//   direct    RGB                       the plan's quantum       every sample; light paths into direct_splats
//   groups    RGB                       the plan's quantum       every sample; light paths into splats
//   lobes     RGB                       the plan's quantum       every sample; light paths into splats
//   variance  RGB squared               2^-60 S^2                every sample
//   diffuse   albedo of diffuse lobes   2^-30                    every sample; a part of albedo
//   uv        U, V + 2^52 steps, hits   2^-32                    samples that hit something
//   motion    X, Y + 2^40 steps, hits  2^-20 pixels             samples that hit something
//   weights   weight, samples, unused   1 / kWeightOne           every sample, where they differ
//
// Under adaptive sampling (common/job/sample_allocation.h) a sample has a weight, a power of two. There all
// but radiance is added weight * kWeightOne times, and means are taken over the layer of weights.
//
// S is the plan's radiance scale (exact_sum.h).
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/film/exact_sum.h"
#include "common/film/splats/splat_sum.h"
#include "common/job/aovs.h"
#include "common/job/lobes.h"
#include "common/job/packet_grid.h"
#include "common/job/sample_allocation.h"

namespace lightmill {

/// Normalised space in the scene's units: p there is origin + p * 2^-scale_exponent.
struct AovFrame {
  int scale_exponent = 0;
  std::array<double, 3> origin{};
  bool operator==(const AovFrame&) const = default;
};

/// The AOVs that a job's partials have.
struct AovSpec {
  Aovs set = 0;
  AovFrame frame = {};
  LightGroups groups = {};  // with kAovLightGroups
  bool weighted = false;    // samples have weights of their own: the job's samples are allocated
  bool operator==(const AovSpec&) const = default;
};

/// The set of a spec, and whether it is weighted, in one number of partials and snapshots.
inline constexpr uint32_t kWeightedBit = 1u << 31;
inline uint32_t packed_set(const AovSpec& spec) { return spec.set | (spec.weighted ? kWeightedBit : 0); }
inline void unpack_set(uint32_t packed, AovSpec* spec) {
  spec->set = packed & ~kWeightedBit;
  spec->weighted = packed & kWeightedBit;
}

enum AovLayer {
  kAlbedoLayer,
  kNormalLayer,
  kPositionLayer,
  kDepthLayer,
  kDirectLayer,
  kVarianceLayer,
  kWeightsLayer,
  kUvLayer,
  kDiffuseAlbedoLayer,
  kMotionLayer,
  kAovLayers
};
/// Whether AOVs of the set are formed from this layer. The weights' is another matter: see the next one.
bool needs_layer(Aovs set, int layer);
/// Whether partials of the spec have this layer.
inline bool has_layer(const AovSpec& spec, int layer) {
  return layer == kWeightsLayer ? spec.set != 0 && spec.weighted : needs_layer(spec.set, layer);
}
/// What a weight of 1 counts, so that all weights are whole numbers.
inline constexpr int kWeightOne = 1 << kMostLevel;

/// How many groups have layers: all but the last one, which has what they leave of the colour.
inline size_t group_layers(const LightGroups& groups) { return groups.empty() ? 0 : groups.size() - 1; }

/// The layers of a part of light in a tile: a light group, or a part of common/job/lobes.h.
struct GroupSums {
  std::vector<ExactRgb> camera;  // one sum a pixel, row-major
  std::vector<SplatSum> splats;  // ascending by pixel, without zeros; part of the splat layer
  bool operator==(const GroupSums&) const = default;
};

/// The layers of a tile or of a film.
struct AovSums {
  AovSpec spec;
  std::array<std::vector<ExactRgb>, kAovLayers> layers;  // one sum a pixel, row-major; empty where not needed
  std::vector<SplatSum> direct_splats;  // ascending by pixel, without zeros; part of the splat layer
  std::vector<GroupSums> groups;        // group_layers of them
  std::vector<GroupSums> lobes;         // lobe_layers of them
  bool operator==(const AovSums&) const = default;
};

// The units that one sample adds.
inline constexpr Units kNormalBias = Units{1} << 31, kPositionBias = Units{1} << 52, kUvBias = kPositionBias,
                       kMotionBias = Units{1} << 40;
Units albedo_units(float reflectance);   // [0, 1]
Units normal_units(float coordinate);    // [-1, 1], with its bias
Units position_units(float coordinate);  // normalised space, with its bias
Units depth_units(float distance);       // normalised space
Units uv_units(float coordinate);        // with its bias; within +-2^20
Units motion_units(float pixels);        // likewise
Units square_units(float radiance, int quantum_exponent);

// The inverse of sums over `weights` (>= 1), which are those of the samples or their number.
double albedo_of(Units sum, int64_t weights);
double normal_of(Units sum, int64_t weights);
/// `hits` >= 1 of the weights; scene units along `axis`.
double position_of(Units sum, int64_t hits, const AovFrame& frame, int axis);
double depth_of(Units sum, int64_t hits, const AovFrame& frame);
double uv_of(Units sum, int64_t hits);
double motion_of(Units sum, int64_t hits);
/// Variance of one of `count` samples: from the sum of squares, whose weights add up to `weights`, and that
/// of radiance over `samples` sample indices. 0 for a single sample.
double variance_of(Units squares, int64_t weights, Units sum, int64_t samples, int64_t count,
                   int quantum_exponent);

/// The bytes that follow a partial's other layers. `tile_pixels`: of its rectangle.
std::string encode_aovs(const AovSums& sums);
/// Inverse. Throws Error(kFailed) for what encode_aovs can't have written, and for more light groups than
/// `most_groups` or lobes that are not in `most`, before there is memory for their layers.
AovSums decode_aovs(std::string_view bytes, size_t tile_pixels, const FilmGrid& grid,
                    size_t most_groups = kMaxLightGroups, Aovs most = kAllAovs);
/// Most bytes that encode_aovs gives for at most `groups` light groups, and lobes if they are in `most`.
size_t max_aov_bytes(size_t tile_pixels, const FilmGrid& grid, size_t groups, Aovs most = kAllAovs);
/// Throws Error(kFailed) unless the layers are those of the spec, in range over `samples` samples of
/// `tile_pixels` pixels, and direct light is a part of `camera` and `splats`.
void check_aovs(const AovSums& sums, const FilmGrid& grid, size_t tile_pixels, int64_t samples,
                const std::vector<ExactRgb>& camera, const std::vector<SplatSum>& splats);

}  // namespace lightmill
