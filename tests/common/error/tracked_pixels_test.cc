// Which pixels the error estimate follows, and their boxes.
#include "common/error/tracked_pixels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <utility>
#include <vector>

#include "common/error/batch_film.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::constant_batch;
using testing::full_grid;
using testing::in_packet_order;
using testing::kQuantum;

// No box of 4x4 fits into these, though they are large.
TEST(TrackedPixels, OfNarrowFilmsAreFollowed) {
  for (const FilmGrid& grid : {full_grid(3, 100000), full_grid(100000, 3), full_grid(1, 300000)}) {
    BatchFilm film(grid);
    for (const int64_t b : {0, 1}) film.fold(constant_batch(grid, b));
    ErrorPoint p, back;
    film.estimate(&p);
    ASSERT_TRUE(p.relmse);
    EXPECT_GT(*p.relmse, 0);
    for (const BoxError& box : p.boxes) EXPECT_EQ(box, BoxError{});
    BatchFilm::restore(film.snapshot()).estimate(&back);
    EXPECT_EQ(back.relmse, p.relmse);
    EXPECT_FALSE(film.error_map(film.error_map_block()).data.empty());
  }
}

/// Normal noise that pixels of a box of `side` have in common, on a grey film.
Partial noise_of_boxes(const FilmGrid& grid, int64_t superblock, int side, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  const int across = grid.crop.width() / side + 1;
  std::vector<double> of_box(static_cast<size_t>(across * (grid.crop.height() / side + 1)));
  for (double& v : of_box) v = 0.5 + 0.1 * normal(rng);
  std::vector<ExactRgb> sums;
  for (int y = 0; y < grid.crop.height(); ++y) {
    for (int x = 0; x < grid.crop.width(); ++x) {
      const double value = of_box[static_cast<size_t>(y / side * across + x / side)];
      const Units units = to_units(static_cast<float>(16 * std::max(value, 0.0)), kQuantum).value();
      sums.push_back({{units, units, units}});
    }
  }
  Partial p;
  p.grid = grid;
  p.tile = {grid.cells(), 16 * superblock, 16 * superblock + 16};
  p.quantum_exponent = kQuantum;
  p.camera = in_packet_order(grid, sums);
  return p;
}

/// Mean over trials of the boxes' error over that of the pixels.
std::array<double, kBoxSides.size()> structure_of_noise(const FilmGrid& grid, int side) {
  constexpr int kTrials = 12;
  std::mt19937_64 rng(5);
  std::array<double, kBoxSides.size()> ratio{};
  for (int t = 0; t < kTrials; ++t) {
    BatchFilm film(grid);
    for (int64_t b = 0; b < 8; ++b) film.fold(noise_of_boxes(grid, b, side, rng));
    ErrorPoint p;
    film.estimate(&p);
    for (size_t i = 0; i < ratio.size(); ++i) {
      ratio[i] += p.boxes[i].relmse.value_or(0) / *p.relmse / kTrials;
      EXPECT_EQ(p.boxes[i].relmse_low.has_value(), kBoxSides[i] < 32) << "there are too few boxes of 32";
    }
  }
  return ratio;
}

// White noise has the same error at every scale. What boxes of 4 have in common has 16 times the error of
// pixels in their means, and no more in those of larger boxes. 432 boxes of 16 in all have an error that is
// known to sqrt(2/432), 108 of 32 to sqrt(2/108); 0.3 and 0.6 are four of them.
TEST(TrackedPixels, ErrorsOfTheirBoxesTellTheStructureOfNoise) {
  const FilmGrid grid = full_grid(96, 96);
  const auto white = structure_of_noise(grid, 1), squares = structure_of_noise(grid, 4);
  for (const auto& [ratio, expected] : {std::pair(white, 1.0), std::pair(squares, 16.0)}) {
    EXPECT_NEAR(ratio[0] / expected, 1, 0.1);
    EXPECT_NEAR(ratio[1] / expected, 1, 0.3);
    EXPECT_NEAR(ratio[2] / expected, 1, 0.6);
  }
}

}  // namespace
}  // namespace lightmill
