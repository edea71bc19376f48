#pragma once
// A partial accumulation buffer ("partial"): what rendering a tile returns, and the builder that render
// threads add to.
//
//   PartialBuilder builder(grid, tile, quantum_exponent, has_camera_layer, has_splat_layer);
//   builder.add_camera(cell_x, cell_y, sums);            // any thread, any order
//   builder.add_splats(splats);
//   builder.add_counters(counters, cpu_seconds);
//   Partial partial = builder.take();
//   std::string bytes = encode_partial(partial);         // zstd, sparse where smaller, digest inside
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/film/aov_layers.h"
#include "common/film/cryptomatte/matte_sums.h"
#include "common/film/dropped.h"
#include "common/film/exact_sum.h"
#include "common/film/splats/splat_sum.h"
#include "common/job/packet_grid.h"

namespace lightmill {

/// What the stages counted while rendering. All add up.
struct RenderCounters {
  uint64_t camera_paths = 0;
  uint64_t light_paths = 0;
  uint64_t closest_hit_rays = 0;
  uint64_t shadow_rays = 0;
  uint64_t zero_connections_skipped = 0;  // contribution was zero: no shadow ray cast
  uint64_t rouletted_connections = 0;     // contribution was tiny and lost its roulette
  uint64_t nonfinite = 0;                 // contributions that the sums refused: Dropped::refused
  RenderCounters& operator+=(const RenderCounters& o);
  bool operator==(const RenderCounters&) const = default;
};

/// A contribution of light tracing to pixel `pixel` = y * width + x of the uncropped film. It is the
/// MIS-weighted measurement of one light path times light_paths_per_spp(): on the scale of a pixel value
/// before division by the number of samples per pixel.
struct Splat {
  uint32_t pixel;
  float r, g, b;
};

struct Partial {
  TileSpec tile;
  FilmGrid grid;
  int quantum_exponent = 0;
  /// Row-major sums over grid.pixels(tile.cells), in packet order (common/job/pixel_interleave.h). Every
  /// pixel got tile.samples() samples. Empty if the integrator has no camera layer (lt).
  std::vector<ExactRgb> camera;
  /// Splat sums over the whole crop window, ascending by pixel, without zeros.
  using SplatSum = lightmill::SplatSum;
  std::vector<SplatSum> splats;
  uint64_t light_paths = 0;  // accepted light paths that fed `splats`
  AovSums aovs;              // its set is 0 unless the job asked for some
  MatteSums mattes;  // of the tile's cells, in packet order; empty unless some of kAovsOfCounts are asked for
  RenderCounters counters;
  Dropped dropped;         // nothing in partials of versions that counted the kinds together
  double cpu_seconds = 0;  // of the worker's threads; informational, not part of the digest's promise
  bool operator==(const Partial&) const = default;
};

/// Collects one tile's packets. Thread-safe: different threads add different packets concurrently.
class PartialBuilder {
 public:
  PartialBuilder(const FilmGrid& grid, const TileSpec& tile, int quantum_exponent, bool has_camera_layer,
                 bool has_splat_layer, const AovSpec& aovs = {});
  ~PartialBuilder();
  PartialBuilder(const PartialBuilder&) = delete;
  PartialBuilder& operator=(const PartialBuilder&) = delete;
  /// Adds a packet's camera sums for cell (cx, cy). `sums` is the cell's 32x32 pixels row-major; entries
  /// outside the crop window are ignored. Throws std::logic_error for a cell outside the tile or without a
  /// camera layer.
  void add_camera(int cx, int cy, std::span<const ExactRgb, kCellPixels> sums);
  /// Rounds splats to the quantum and adds them. Those that can't be represented are dropped and counted,
  /// those outside the crop window are ignored. Throws std::logic_error without a splat layer.
  void add_splats(std::span<const Splat> splats);
  /// The AOVs that packets have to bring. Those of the camera layer's pixels are added as by add_camera, one
  /// layer at a time. Splats that are direct light are added here once more. Throws std::logic_error for what
  /// the spec does not have.
  const AovSpec& aovs() const;
  void add_aov(int layer, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums);
  void add_direct_splats(std::span<const Splat> splats);
  /// Likewise of a light group, one of group_layers; and splats of any group, in place of add_splats.
  void add_group(size_t group, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums);
  void add_group_splats(size_t group, std::span<const Splat> splats);
  /// Likewise of a part of light, one of lobe_layers; its splats are added here once more. What one part
  /// leaves to another is a splat of the opposite sign.
  void add_lobe(size_t part, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums);
  void add_lobe_splats(size_t part, std::span<const Splat> splats);
  /// Likewise for Cryptomatte and ids what a packet's samples hit first. `names`: of the numbers in keys, the
  /// same for all packets.
  void add_mattes(int cx, int cy, const MatteCell& counts, const std::shared_ptr<const MatteList>& names);
  /// Adds a finished packet's counters. Its light_paths also count for the splat layer.
  void add_counters(const RenderCounters& counters, double cpu_seconds);
  /// Adds what a finished packet's stages dropped of camera paths (amounts by pixel sample) and of light
  /// paths (amounts by light path). What the sums refused of it is in the packet's counters, too.
  void add_dropped(const Dropped& of_camera_paths, const Dropped& of_light_paths);
  /// The finished partial. Call once, after all packets.
  Partial take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Version of the encoding: the `schema` that workers register with.
inline constexpr int kPartialSchema = 3;
/// The version that has the same form, of films that are not interleaved. Such partials are still written for
/// jobs that an older version began.
inline constexpr int kPlainPartialSchema = 2;
/// Bounds of tiles that are accepted. With kMaxContributionBits they keep a tile's sums below 2^126.
inline constexpr int64_t kMaxSampleIndex = int64_t{1} << 40;
inline constexpr int64_t kMaxTileSamples = int64_t{1} << 31;
inline constexpr int kMaxSumBits = 126;

/// Lossless, compressed, with a SHA-256 over the content. Splats are sent sparse or dense, whichever is
/// smaller. Throws Error(kFailed) for a partial that decode_partial would refuse.
std::string encode_partial(const Partial& partial);
/// Inverse. Throws Error(kFailed) with the reason: a wrong digest, truncation, a decompressed size over what
/// the tile and grid allow, pixels outside the crop, counts that do not add up, or sums out of range.
/// Allocates up to what the tile and grid *in the bytes* call for. So for bytes from an untrusted peer use
/// the second form: it refuses another grid or tile than that of the lease before it allocates anything.
Partial decode_partial(std::string_view bytes);
Partial decode_partial(std::string_view bytes, const FilmGrid& grid, const TileSpec& tile);
/// SHA-256 of the partial's content (tile, layers, counts; not cpu_seconds or amounts of what was dropped).
std::string partial_digest(const Partial& partial);
/// The digest that encoded bytes carry: partial_digest(decode_partial(bytes)) if that succeeds. Throws
/// Error(kFailed) if the header is corrupt.
std::string encoded_digest(std::string_view bytes);

}  // namespace lightmill
