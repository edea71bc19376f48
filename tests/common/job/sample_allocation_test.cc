#include "common/job/sample_allocation.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/job/settings.h"

namespace lightmill {
namespace {

FilmGrid film(int width, int height, PixelRect crop = {}) {
  if (crop.empty()) crop = {0, 0, width, height};
  return {width, height, crop};
}

TEST(Regions, AreAsSmallAsTheirNumberAllows) {
  EXPECT_EQ(regions_of(film(64, 64)).side, 8);
  EXPECT_EQ(regions_of(film(512, 512)).side, 8);
  EXPECT_EQ(regions_of(film(513, 512)).side, 16);
  const RegionGrid large = regions_of(film(65536, 4096));
  EXPECT_LE(large.count(), kMaxRegions);
  EXPECT_LT(large.at(65535, 4095), large.count());
  // A crop window's regions begin with its first cell.
  const RegionGrid cut = regions_of(film(4096, 4096, {100, 40, 200, 90}));
  EXPECT_EQ(cut.side, 8);
  EXPECT_EQ(cut.x0, 96);
  EXPECT_EQ(cut.y0, 32);
  EXPECT_EQ(cut.at(96, 32), 0);
  EXPECT_EQ(cut.at(104, 32), 1);
  EXPECT_EQ(cut.at(96, 40), cut.columns);
}

TEST(AdaptiveSampling, CountsCameraPaths) {
  const FilmGrid grid = film(16, 8);
  const RegionGrid regions = regions_of(grid);
  SampleAllocation map{std::string(static_cast<size_t>(regions.count()), '2')};
  map.set_level(0, -2);
  map.set_level(1, 1);
  const TileSpec all{{0, 0, 1, 1}, 0, 16};
  // Four samples everywhere, then a quarter in one half of the picture and two for one in the other.
  const PathCount count = camera_paths_of(map, grid, all);
  EXPECT_EQ(count.least, 64u * (4 + 3) + 64u * (4 + 24));
  EXPECT_EQ(count.most, count.least);
  const PathCount cut = camera_paths_of(map, grid, {{0, 0, 1, 1}, 6, 9});
  EXPECT_EQ(cut.least, 64u * 0 + 64u * 6);
  EXPECT_EQ(cut.most, 64u * 2 + 64u * 6);
  const PathCount uniform = camera_paths_of({}, grid, all);
  EXPECT_EQ(uniform.least, 128u * 16);
  EXPECT_EQ(uniform.most, 128u * 16);
}

TEST(AdaptiveSampling, IsRefusedForAnotherFilm) {
  const FilmGrid grid = film(16, 8);
  EXPECT_NO_THROW(check_allocation(SampleAllocation{}, grid));
  EXPECT_NO_THROW(check_allocation(SampleAllocation{std::string(16, '4')}, grid));
  EXPECT_THROW(check_allocation(SampleAllocation{std::string(15, '4')}, grid), Error);
  EXPECT_THROW(check_allocation(SampleAllocation{std::string(16, '5')}), Error);
  EXPECT_THROW(check_allocation(SampleAllocation{"12/"}), Error);
  EXPECT_THROW(check_allocation(SampleAllocation{std::string(kMaxRegions + 1, '2')}), Error);
}

TEST(AdaptiveSampling, IsPartOfThePlanAndTheSettings) {
  SamplingPlan plan;
  plan.allocation.levels = "0123401234012340";
  EXPECT_EQ(plan_from_json(plan_to_json(plan)), plan);
  EXPECT_THROW(
      plan_from_json(R"({"connections":1,"sample_allocation":"x","light_paths":1,"strategies":"hit"})"),
      Error);
  RenderSettings settings;
  settings.grid = film(16, 8);
  settings.plan = plan;
  EXPECT_EQ(settings_from_json(settings_to_json(settings)).plan, plan);
  settings.grid = film(160, 80);
  EXPECT_THROW(settings_from_json(settings_to_json(settings)), Error);
}

}  // namespace
}  // namespace lightmill
