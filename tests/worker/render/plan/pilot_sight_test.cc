// Which cells and pixels a look at a scene takes in.
#include "worker/render/plan/pilot_sight.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

FilmGrid film(int width, int height) { return {width, height, {0, 0, width, height}}; }

/// Pixels of the film that it looks at.
int64_t pixels_of(const FilmGrid& grid, const PilotSight& sight) {
  int64_t sum = 0;
  for (size_t i = 0; i < sight.cells.size(); ++i) {
    const PixelRect r = grid.pixels(sight.rect(i));
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x) sum += sight.thinning.keeps(x, y);
    }
  }
  return sum;
}

// A film need not fill its cells: of 28 x 28 pixels, four paths each, none was looked at once.
TEST(PilotSight, TakesInAllOfASmallFilm) {
  for (const auto& [width, height] : {std::pair{1, 1}, {28, 28}, {30, 30}, {33, 5}, {70, 40}, {100, 100}}) {
    const FilmGrid grid = film(width, height);
    for (const int64_t per_pixel : {2, 4, 16}) {
      const PilotSight sight(grid, per_pixel * grid.crop.area());
      EXPECT_EQ(sight.samples, per_pixel) << width;
      EXPECT_EQ(pixels_of(grid, sight), grid.crop.area()) << width << " x " << height;
    }
  }
}

TEST(PilotSight, TakesNoMorePathsThanItMay) {
  constexpr int64_t kPaths = 3 << 16;
  for (const auto& [width, height] :
       {std::pair{64, 64}, {100, 100}, {240, 240}, {640, 360}, {1920, 1080}, {9000, 7000}}) {
    const FilmGrid grid = film(width, height);
    const PilotSight sight(grid, kPaths, 8);
    EXPECT_GE(sight.samples, 8);
    const int64_t paths = sight.samples * pixels_of(grid, sight);
    EXPECT_LE(paths, kPaths + kPaths / 16) << width << " x " << height;
    EXPECT_GT(paths, kPaths / 4) << width << " x " << height;
  }
}

}  // namespace
}  // namespace lightmill
