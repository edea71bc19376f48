#include "coordinator/merge/store_check.h"

#include "coordinator/merge/merger.h"
#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

void fail(const JobId& job, const std::string& what) {
  throw Error(ErrorKind::kFailed, "job " + job.value + ": " + what);
}

/// Samples per pixel of every cell by the committed tiles, row-major over the grid's cells.
std::vector<int64_t> committed_samples(const CellRect& all, const std::vector<TileRecord>& tiles) {
  std::vector<int64_t> samples(static_cast<size_t>(all.count()), 0);
  for (const TileRecord& tile : tiles) {
    if (tile.state != TileState::kCommitted || is_pilot(tile.tile)) continue;
    const CellRect& cells = tile.tile.cells;
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) {
        samples[static_cast<size_t>(int64_t{y - all.y0} * all.width() + x - all.x0)] += tile.tile.samples();
      }
    }
  }
  return samples;
}

/// The record's totals against the ledger's.
void check_totals(const JobRecord& job, const std::vector<TileRecord>& tiles, const Film& film) {
  int64_t committed = 0, pixel_samples = 0;
  for (const TileRecord& tile : tiles) {
    if (tile.state != TileState::kCommitted || is_pilot(tile.tile)) continue;
    ++committed;
    pixel_samples += job.settings.grid.pixels(tile.tile.cells).area() * tile.tile.samples();
  }
  if (committed != job.tiles_committed) {
    fail(job.id, "the ledger has " + std::to_string(committed) + " committed tiles, the job's total is " +
                     std::to_string(job.tiles_committed));
  }
  if (pixel_samples != job.pixel_samples) {
    fail(job.id, "the ledger has " + std::to_string(pixel_samples) +
                     " committed pixel samples, the job's total is " + std::to_string(job.pixel_samples));
  }
  if (!(film.counters() == job.counters)) fail(job.id, "the film's counters are not the job's");
}

}  // namespace

void check_film(const JobId& job, const RenderSettings& settings, const std::vector<TileRecord>& tiles,
                const Film& film) {
  if (!(film.grid() == settings.grid)) fail(job, "the stored film has another size than the job");
  if (needs_pilot(settings) || !has_camera_layer(settings)) return;  // its samples are not counted by cell
  const CellRect all = settings.grid.cells();
  const std::vector<int64_t> committed = committed_samples(all, tiles);
  size_t i = 0;
  for (int y = all.y0; y < all.y1; ++y) {
    for (int x = all.x0; x < all.x1; ++x, ++i) {
      if (film.cell_samples(x, y) == committed[i]) continue;
      fail(job, "the stored film has " + std::to_string(film.cell_samples(x, y)) + " samples in cell " +
                    std::to_string(x) + "," + std::to_string(y) + ", the ledger " +
                    std::to_string(committed[i]));
    }
  }
}

std::vector<std::string> check_store(JobStore& store) {
  std::vector<std::string> problems;
  Merger merger(store, 0);  // one at a time
  for (const JobRecord& job : store.jobs()) {
    try {
      const Merger::Open layers = merger.open(job.id, job.settings);
      check_totals(job, store.tiles(job.id), layers->film);
    } catch (const StoreError&) {
      throw;
    } catch (const Error& error) {
      problems.emplace_back(error.what());
    }
  }
  return problems;
}

}  // namespace lightmill
