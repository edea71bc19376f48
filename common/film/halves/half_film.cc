#include "common/film/halves/half_film.h"

#include <algorithm>
#include <bit>

#include "common/film/halves/layer_sums.h"
#include "common/film/packing.h"
#include "common/film/stored_layer.h"
#include "common/job/replicates.h"

namespace lightmill {

namespace {

constexpr AovLayer kLayersOfHalves[] = {kAlbedoLayer, kNormalLayer, kDepthLayer, kWeightsLayer};

bool of_replicate_0(const TileSpec& tile) {
  const int64_t begin = superblock_of_sample(tile.sample_begin);
  return superblock_of_sample(tile.sample_end - 1) < replicate_run_end(begin) &&
         replicate_of(begin).replicate == 0;
}

}  // namespace

bool HalfFilm::holds(const TileSpec& tile) const {
  return half_end_ < kSuperblockSamples ? tile.sample_end <= half_end_ : of_replicate_0(tile);
}

void HalfFilm::fold(const Partial& partial, const Film& film) {
  const int64_t begin = partial.tile.sample_begin;
  groups_.resize(partial.aovs.groups.size());
  if (half_end_ < kSuperblockSamples && begin >= 2 * half_end_) {
    // The film has nothing yet from here on, but for this partial.
    half_end_ =
        std::min(kSuperblockSamples, static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(begin))));
    camera_ = film.camera;
    splat_ = film.splat;
    for (const AovLayer layer : kLayersOfHalves) layers_[layer] = film.aovs.layers[layer];
    groups_ = film.groups;
    cell_samples_ = film.cell_samples;
    light_paths_ = film.light_paths;
    if (!holds(partial.tile)) add(partial, true);
  } else if (holds(partial.tile)) {
    add(partial, false);
  }
}

void HalfFilm::add(const Partial& partial, bool subtract) {
  const FilmGrid& grid = partial.grid;
  const PixelRect r = grid.pixels(partial.tile.cells);
  add_rectangle(grid, r, partial.camera, subtract, &camera_);
  for (const AovLayer layer : kLayersOfHalves) {
    add_rectangle(grid, r, partial.aovs.layers[layer], subtract, &layers_[layer]);
  }
  add_splats(grid, partial.splats, subtract, &splat_);
  for (size_t i = 0; i < groups_.size(); ++i) {
    add_rectangle(grid, r, partial.aovs.groups[i].camera, subtract, &groups_[i].camera);
    add_splats(grid, partial.aovs.groups[i].splats, subtract, &groups_[i].splat);
  }
  light_paths_ += subtract ? uint64_t{0} - partial.light_paths : partial.light_paths;
  if (partial.camera.empty()) return;  // as the film counts
  const CellRect all = grid.cells();
  const CellRect& cells = partial.tile.cells;
  const int64_t samples = subtract ? -partial.tile.samples() : partial.tile.samples();
  cell_samples_.resize(static_cast<size_t>(all.count()));
  for (int cy = cells.y0; cy < cells.y1; ++cy) {
    for (int cx = cells.x0; cx < cells.x1; ++cx) {
      cell_samples_[static_cast<size_t>(int64_t{cy - all.y0} * all.width() + cx - all.x0)] += samples;
    }
  }
}

void HalfFilm::write(bool weighted, ByteWriter* out) const {
  out->put<int64_t>(half_end_);
  out->put<uint64_t>(light_paths_);
  out->put<uint64_t>(cell_samples_.size());
  for (const int64_t samples : cell_samples_) out->put<int64_t>(samples);
  put_stored_layer(camera_, out);
  put_stored_layer(splat_, out);
  for (const AovLayer layer : kLayersOfHalves) {
    if (weighted || layer != kWeightsLayer) put_stored_layer(layers_[layer], out);
  }
  for (const GroupLayers& group : groups_) {
    put_stored_layer(group.camera, out);
    put_stored_layer(group.splat, out);
  }
}

void HalfFilm::read(ByteReader* in, const FilmGrid& grid, bool weighted, size_t groups) {
  half_end_ = in->get<int64_t>();
  if (half_end_ < 1 || half_end_ > kSuperblockSamples) in->fail("unknown half");
  light_paths_ = in->get<uint64_t>();
  const auto cells = in->get<uint64_t>();
  if (cells != 0 && cells != static_cast<uint64_t>(grid.cells().count())) in->fail("cells of another film");
  cell_samples_.resize(cells);
  for (int64_t& samples : cell_samples_) {
    samples = in->get<int64_t>();
    if (samples < 0) in->fail("negative count");
  }
  const auto pixels = static_cast<size_t>(grid.crop.area());
  camera_ = get_stored_layer(pixels, in);
  splat_ = get_stored_layer(pixels, in);
  for (const AovLayer layer : kLayersOfHalves) {
    if (weighted || layer != kWeightsLayer) layers_[layer] = get_stored_layer(pixels, in);
  }
  groups_.resize(groups);
  for (GroupLayers& group : groups_) {
    group.camera = get_stored_layer(pixels, in);
    group.splat = get_stored_layer(pixels, in);
  }
}

}  // namespace lightmill
