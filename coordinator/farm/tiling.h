#pragma once
// Cuts rounds into tiles. A round is the whole crop window over a range of sample indices, split into
// rectangles of cells. Sums are exact, so no decision made here shows in a pixel: it may depend on measured
// speed.
#include <cstdint>
#include <vector>

#include "common/job/packet_grid.h"

namespace lightmill {

struct TilingInput {
  FilmGrid grid;
  int64_t begin = 0;                     // first sample index that no round covers yet
  int64_t spp = 0;                       // of the job; begin < spp
  int workers = 1;                       // that could take part
  double worker_samples_per_second = 0;  // measured mean per worker; 0: not known yet
  double target_tile_seconds = 1;
  int64_t previous_tile_samples = 0;  // pixel samples per tile of the last round; 0: this is the first
  int64_t max_superblocks = 1;        // BatchFilm::max_tile_superblocks()
  // Fewest superblocks beyond the first one that a round should span. A tile's bytes go by its pixels, so
  // deeper tiles bring fewer of them a second. A power of two; above max_superblocks it costs batches.
  int64_t min_superblocks = 1;
  double seconds_left = -1;    // of --time; negative: no limit
  bool to_checkpoint = false;  // of a job with a target error: the round ends at a checkpoint at the latest
  bool denoised_checkpoint = false;  // those are next_denoised_checkpoint()
  bool splats = false;  // partials have splats, over a crop window large enough to make them heavy
  bool halves = false;  // the film keeps a half of the samples apart (common/film/halves/half_film.h)
  int64_t min_tile_samples = 0;  // with splats: least samples of a tile by the ingest budget
};

/// The tiles of the next round, all with the same sample range [begin, end).
///
/// The range ends at a block's end within the first superblock, later at a superblock's end, never beyond
/// spp. Several superblocks of one aligned group of `max_superblocks` are taken together if a single one is
/// less work than two target tiles per worker and, of one cell, than a target tile; or if min_superblocks
/// asks for it. With to_checkpoint a round does not pass the next checkpoint. With a time limit the range is
/// cut to what fits. A tile takes about target_tile_seconds, but has no more than twice the samples of the
/// last round's tiles. There are at least two tiles per worker where the grid has as many cells. Empty if
/// less than half a sample per pixel fits into the time left.
///
/// With splats a partial has about as many bytes as the crop window has pixels, however few pixels its tile
/// has. So tiles are as large as can be. One takes up to kSplatTileFactor times as long, if that is what
/// kFullSplatSpp samples for every pixel of the window take, and grows faster from round to round. A round
/// may be a single tile. Towards the end, when only a few tiles for every worker are left, tiles become
/// smaller, down to kLeastSplatSpp samples for every pixel of the window, but every worker gets one.
std::vector<TileSpec> plan_round(const TilingInput& input);

/// Splits `cells` into about `count` nearly equal rectangles, row-major, of at least one cell each.
std::vector<CellRect> split_cells(const CellRect& cells, int64_t count);

}  // namespace lightmill
