#include "common/film/film.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/error.h"
#include "common/job/pixel_interleave.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::full_grid;
using testing::random_partial;

std::vector<Partial> some_partials(const FilmGrid& grid) {
  std::vector<Partial> partials;
  uint64_t seed = 1;
  const CellRect cells = grid.cells();
  for (int64_t s = 0; s < 64; s += 16) {
    for (int cy = cells.y0; cy < cells.y1; ++cy) {
      partials.push_back(
          random_partial(grid, {{cells.x0, cy, cells.x1, cy + 1}, s, s + 16}, seed++, true, 3));
    }
  }
  return partials;
}

Film fold_all(const FilmGrid& grid, const std::vector<Partial>& partials) {
  Film film(grid);
  for (const Partial& p : partials) film.fold(p);
  return film;
}

TEST(Film, TheOrderOfFoldsDoesNotShow) {
  const FilmGrid grid{100, 90, {9, 2, 97, 81}};
  std::vector<Partial> partials = some_partials(grid);
  const Image expected = fold_all(grid, partials).resolve();
  const std::string snapshot = fold_all(grid, partials).snapshot();
  std::mt19937_64 rng(5);
  for (int trial = 0; trial < 8; ++trial) {
    std::shuffle(partials.begin(), partials.end(), rng);
    const Film film = fold_all(grid, partials);
    EXPECT_EQ(film.resolve().data, expected.data);
    EXPECT_EQ(film.snapshot(), snapshot);
  }
}

TEST(Film, ARestartInTheMiddleDoesNotShow) {
  const FilmGrid grid{100, 90, {9, 2, 97, 81}};
  const std::vector<Partial> partials = some_partials(grid);
  const Film whole = fold_all(grid, partials);
  for (const size_t cut : {size_t{0}, size_t{1}, size_t{5}, partials.size()}) {
    Film first = fold_all(grid, {partials.begin(), partials.begin() + static_cast<std::ptrdiff_t>(cut)});
    Film film = Film::restore(first.snapshot());
    for (size_t i = cut; i < partials.size(); ++i) film.fold(partials[i]);
    EXPECT_EQ(film.resolve().data, whole.resolve().data);
    EXPECT_EQ(film.light_paths(), whole.light_paths());
    EXPECT_EQ(film.counters(), whole.counters());
    EXPECT_EQ(film.cell_samples(1, 1), 64);
    EXPECT_EQ(film.snapshot(), whole.snapshot());
  }
}

TEST(Film, ResolvesLayersByTheirOwnCounts) {
  const FilmGrid grid = full_grid(33, 2);  // two cells
  Film film(grid);
  Partial camera;
  camera.grid = grid;
  camera.quantum_exponent = -4;
  camera.tile = {{0, 0, 1, 1}, 0, 4};
  camera.camera.assign(64, ExactRgb{{16 * 4, 16 * 8, 16 * 2}});  // sums 4, 8, 2 of four samples
  film.fold(camera);
  Partial light;
  light.grid = grid;
  light.quantum_exponent = -4;
  light.tile = {{0, 0, 2, 1}, 0, 2};
  light.light_paths = 132;  // two per pixel
  // Pixels of the image that belong to the two cells.
  const PixelInterleave interleave(grid);
  const FilmPixel first = interleave.to_film(0, 0), last = interleave.to_film(31, 1),
                  other = interleave.to_film(32, 0), below = interleave.to_film(32, 1);
  const auto number = [](const FilmPixel& p) { return static_cast<uint32_t>(p.y * 33 + p.x); };
  light.splats = {{number(first), {{16, 0, 0}}}, {number(other), {{32, 16, 0}}}};
  std::sort(light.splats.begin(), light.splats.end(), [](auto& a, auto& b) { return a.pixel < b.pixel; });
  film.fold(light);
  const Image image = film.resolve();
  ASSERT_EQ(image.width, 33);
  EXPECT_EQ(image.pixel(first.x, first.y)[0], 1.5f);
  EXPECT_EQ(image.pixel(first.x, first.y)[1], 2.0f);
  EXPECT_EQ(image.pixel(first.x, first.y)[2], 0.5f);
  EXPECT_EQ(image.pixel(last.x, last.y)[1], 2.0f);
  EXPECT_EQ(image.pixel(other.x, other.y)[0], 1.0f);  // no camera samples here
  EXPECT_EQ(image.pixel(other.x, other.y)[1], 0.5f);
  EXPECT_EQ(image.pixel(below.x, below.y)[0], 0.0f);
  // To look at, what is missing is that of the pixels around.
  const Image shown = film.resolve_for_display();
  EXPECT_EQ(shown.pixel(first.x, first.y)[0], 1.5f);
  EXPECT_EQ(shown.pixel(other.x, other.y)[0], 2.0f);
  EXPECT_EQ(shown.pixel(below.x, below.y)[1], 2.0f);
  EXPECT_EQ(film.cell_samples(0, 0), 4);
  EXPECT_EQ(film.cell_samples(1, 0), 0);
  EXPECT_THROW(film.cell_samples(2, 0), std::logic_error);
}

TEST(Film, ADuplicateShowsInTheCounts) {
  // The film itself does not know its ledger; a duplicate that slipped through must be visible.
  const FilmGrid grid = full_grid(32, 32);
  const Partial p = random_partial(grid, {{0, 0, 1, 1}, 0, 16}, 1, true, 2);
  Film film(grid);
  film.fold(p);
  const Image once = film.resolve();
  film.fold(p);
  EXPECT_EQ(film.cell_samples(0, 0), 32);
  EXPECT_EQ(film.light_paths(), 2 * p.light_paths);
  EXPECT_EQ(film.resolve().data, once.data);  // twice the sums over twice the counts
}

TEST(Film, RefusesOtherGridsQuantaAndOverflow) {
  const FilmGrid grid = full_grid(32, 32);
  const TileSpec tile{{0, 0, 1, 1}, 0, 16};
  Film film(grid);
  film.fold(random_partial(grid, tile, 1, true, 2));
  EXPECT_THROW(film.fold(random_partial(full_grid(33, 32), tile, 1, true, 2)), Error);
  Partial other = random_partial(grid, tile, 1, true, 2);
  other.quantum_exponent += 1;
  EXPECT_THROW(film.fold(other), Error);

  Partial bright = random_partial(grid, tile, 2, true, 0);
  bright.camera[7].c[1] = (Units{1} << kMaxSumBits) - 1;
  film.fold(bright);
  const std::string before = film.snapshot();
  EXPECT_THROW(film.fold(bright), Error);
  EXPECT_EQ(film.snapshot(), before);  // nothing of a refused partial stays
}

TEST(Film, AnEmptyFilmIsBlackAndRestores) {
  const FilmGrid grid = full_grid(5, 3);
  const Film film = Film::restore(Film(grid).snapshot());
  EXPECT_EQ(film.grid(), grid);
  const Image image = film.resolve();
  EXPECT_EQ(image.data, std::vector<float>(45, 0.0f));
}

TEST(Film, CorruptSnapshotsAreRefused) {
  const FilmGrid grid = full_grid(32, 8);
  Film film(grid);
  film.fold(random_partial(grid, {{0, 0, 1, 1}, 0, 16}, 1, true, 2));
  const std::string good = film.snapshot();
  for (size_t i = 0; i < good.size(); i += 7) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x04);
    EXPECT_THROW(Film::restore(bad), Error);
    EXPECT_THROW(Film::restore(good.substr(0, i)), Error);
  }
}

}  // namespace
}  // namespace lightmill
