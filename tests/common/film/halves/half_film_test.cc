// The AOV `difference`: of sums whose halves are known.
#include "common/film/halves/half_film.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/film/film.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::full_grid;
using testing::kQuantum;

/// Samples [begin, end) of one value each, and splats of another.
Partial samples(const FilmGrid& grid, int64_t begin, int64_t end, float value, float splat = 0) {
  Partial p;
  p.grid = grid;
  p.quantum_exponent = kQuantum;
  p.tile = {grid.cells(), begin, end};
  p.aovs.spec.set = kAovDifference;
  const auto count = static_cast<float>(end - begin);
  p.camera.assign(static_cast<size_t>(grid.crop.area()),
                  ExactRgb{{*to_units(count * value, kQuantum), 0, 0}});
  if (splat > 0) {
    p.light_paths = static_cast<uint64_t>(grid.crop.area() * (end - begin));
    for (uint32_t i = 0; i < static_cast<uint32_t>(grid.crop.area()); ++i) {
      p.splats.push_back({i, {{*to_units(count * splat, kQuantum), 0, 0}}});
    }
  }
  return p;
}

double difference_of(const Film& film) {
  const ChannelImage aovs = film.resolve_aovs();
  EXPECT_EQ(aovs.channels, (std::vector<std::string>{"difference.R", "difference.G", "difference.B"}));
  return aovs.image.data[0];
}

TEST(HalfFilm, BeforeTheSecondReplicateTheHalvesAreThoseOfTheFirst) {
  const FilmGrid grid = full_grid(5, 3);
  Film film(grid);
  film.fold(samples(grid, 0, 1, 1));
  EXPECT_EQ(difference_of(film), 0);  // one sample says nothing
  film.fold(samples(grid, 1, 8, 1));
  film.fold(samples(grid, 8, 16, 4));
  EXPECT_NEAR(difference_of(film), (1 - 4) / 2.0, 1e-6);
}

TEST(HalfFilm, ThenTheyAreTheReplicates) {
  const FilmGrid grid = full_grid(5, 3);
  Film film(grid);
  // Superblocks 0 and 2 are of replicate 0: 32 samples of 1, against 16 of 4. In whatever order they come.
  for (const int64_t k : {0, 2, 1}) film.fold(samples(grid, 16 * k, 16 * k + 16, k == 1 ? 4.0f : 1.0f));
  EXPECT_NEAR(difference_of(film), std::sqrt(2.0 / 9) * (1 - 4), 1e-6);
}

TEST(HalfFilm, SplatsCountByTheirLightPaths) {
  const FilmGrid grid = full_grid(5, 3);
  Film film(grid);
  film.fold(samples(grid, 0, 16, 1, 2));
  film.fold(samples(grid, 16, 32, 3, 8));
  EXPECT_NEAR(difference_of(film), (1 + 2 - 3 - 8) / 2.0, 1e-6);
  EXPECT_EQ(film.resolve().data[0], 2 + 5);
}

TEST(HalfFilm, TheOrderOfPartialsDoesNotShow) {
  const FilmGrid grid = full_grid(70, 40);
  const CellRect all = grid.cells();
  std::vector<Partial> partials;
  uint64_t seed = 0;
  for (const auto& [begin, end] : {std::pair<int64_t, int64_t>{0, 1}, {1, 8}, {8, 16}, {16, 32}, {32, 64}}) {
    for (int half = 0; half < 2; ++half) {
      const int middle = (all.x0 + all.x1) / 2;
      const CellRect cells =
          half ? CellRect{middle, all.y0, all.x1, all.y1} : CellRect{all.x0, all.y0, middle, all.y1};
      partials.push_back(testing::random_partial(grid, {cells, begin, end}, ++seed, true, 3));
      partials.back().aovs.spec.set = kAovDifference;
    }
  }
  Film forward(grid), backward(grid);
  for (const Partial& p : partials) {
    forward.fold(p);
    forward = Film::restore(forward.snapshot());
  }
  // A round may begin before the last one is over.
  std::swap(partials[1], partials[2]);
  std::swap(partials[4], partials[6]);
  std::swap(partials[7], partials[8]);
  for (const Partial& p : partials) backward.fold(p);
  EXPECT_EQ(forward.resolve_aovs().image.data, backward.resolve_aovs().image.data);
  EXPECT_NE(difference_of(forward), 0);
}

}  // namespace
}  // namespace lightmill
