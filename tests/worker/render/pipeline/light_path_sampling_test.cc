// Light paths of a superblock are one low-discrepancy point set over the film, and those of a packet one of
// their own.
#include "worker/render/pipeline/light_path_sampling.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>
#include <vector>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

struct Point {
  float u, v;
};

/// Each box of 2^-a by 2^-(bits - a) has one of 2^bits points.
void expect_net(const std::vector<Point>& points, int bits) {
  ASSERT_EQ(points.size(), size_t{1} << bits);
  for (int a = 0; a <= bits; ++a) {
    std::set<uint64_t> boxes;
    for (const Point& p : points)
      boxes.insert((static_cast<uint64_t>(std::ldexp(p.u, a)) << 32) +
                   static_cast<uint64_t>(std::ldexp(p.v, bits - a)));
    EXPECT_EQ(boxes.size(), points.size()) << a;
  }
}

TEST(LightPathSampling, IsEvenOverTheFilmAndInEveryPacket) {
  const TestScene s = cornell_room().film(64, 64);
  for (const double light_paths : {1.0, 0.25}) {
    RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 16, 4);
    settings.plan = SamplingPlan{.light_paths = light_paths};
    const Renderer renderer(s.scene, settings, 1);
    const StageContext& context = renderer.context();
    std::vector<Point> film;
    std::set<float> times;
    for (int cell = 0; cell < 4; ++cell) {
      LayerContext layer;
      layer.light_paths = light_paths_of_layer(context.light_paths, kCellPixels);
      set_light_path_sampling(context, cell % 2, cell / 2, 3, &layer);
      std::vector<Point> packet;
      for (layer.sample_in_superblock = 0; layer.sample_in_superblock < kSuperblockSamples;
           ++layer.sample_in_superblock) {
        for (int i = 0; i < layer.light_paths; ++i) {
          Point p;
          layer.light_stream<float>(i).get_2d(kDimLightDirection, &p.u, &p.v);
          packet.push_back(p);
        }
      }
      expect_net(packet, light_paths == 1 ? 14 : 12);
      film.insert(film.end(), packet.begin(), packet.end());
      for (uint32_t i = 0; i < kSuperblockSamples; ++i)
        times.insert(std::floor(
            64 * SampleStream<float>{layer.light_key, layer.packet_index + i}.get_1d(kDimLayerTime)));
    }
    expect_net(film, light_paths == 1 ? 16 : 14);
    EXPECT_EQ(times.size(), 64u);
  }
}

// Light paths of one pixel in 16 start with few numbers in each cell: together they go everywhere.
TEST(LightPathSampling, OfALookAtFewPixelsGoesEverywhere) {
  const TestScene s = cornell_room().film(128, 128);
  const RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 16, 4);
  const Renderer scene(s.scene, settings, 1), preview(scene, settings, PixelSubset{16});
  std::set<int> boxes;
  for (int cell = 0; cell < 64; ++cell) {
    LayerContext layer;
    layer.light_paths = light_paths_of_layer(preview.context().light_paths, kCellPixels / 16);
    set_light_path_sampling(preview.context(), cell % 4, cell / 4, 3, &layer);
    for (int i = 0; i < layer.light_paths; ++i) {
      Point p;
      layer.light_stream<float>(i).get_2d(kDimLightDirection, &p.u, &p.v);
      boxes.insert(static_cast<int>(32 * p.u) * 32 + static_cast<int>(32 * p.v));
    }
  }
  // 1024 points by chance would be in 647 of as many boxes.
  EXPECT_GT(boxes.size(), 580u);
}

/// The directions' random numbers of all light paths of a cell and superblock of a film of 64x64.
std::vector<Point> points_of(const StageContext& context, int cell, int64_t superblock) {
  LayerContext layer;
  layer.light_paths = light_paths_of_layer(context.light_paths, kCellPixels);
  set_light_path_sampling(context, cell % 2, cell / 2, superblock, &layer);
  std::vector<Point> points;
  for (layer.sample_in_superblock = 0; layer.sample_in_superblock < kSuperblockSamples;
       ++layer.sample_in_superblock) {
    for (int i = 0; i < layer.light_paths; ++i) {
      Point p;
      layer.light_stream<float>(i).get_2d(kDimLightDirection, &p.u, &p.v);
      points.push_back(p);
    }
  }
  return points;
}

// The superblocks of a replicate go on with one sequence: four of them are a net of four times the size.
TEST(LightPathSampling, GoesOnOverSuperblocks) {
  const TestScene s = cornell_room().film(64, 64);
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 16, 4);
  settings.plan = SamplingPlan{.light_paths = 0.25};
  const Renderer renderer(s.scene, settings, 1);
  std::vector<Point> film, packet;
  for (const int64_t k : {0, 2, 4, 5}) {
    ASSERT_EQ(replicate_of(k).replicate, 0);
    for (int cell = 0; cell < 4; ++cell) {
      const std::vector<Point> points = points_of(renderer.context(), cell, k);
      film.insert(film.end(), points.begin(), points.end());
      if (cell == 1) packet.insert(packet.end(), points.begin(), points.end());
    }
  }
  expect_net(film, 16);
  // Those of a packet are not the same again and again: by chance 63 % of as many strata would have one.
  for (const float Point::*axis : {&Point::u, &Point::v}) {
    std::set<int> strata;
    for (const Point& p : packet)
      strata.insert(static_cast<int>(static_cast<float>(packet.size()) * p.*axis));
    EXPECT_GE(strata.size(), packet.size() / 2);
  }
  // The other replicate has points of its own.
  const Point first = points_of(renderer.context(), 0, 0)[0], other = points_of(renderer.context(), 0, 1)[0];
  EXPECT_NE(first.u, other.u);
}

// Of 2^32 paths and more, which a number has no room for, each part has a key.
TEST(LightPathSampling, HasANewKeyWhereNumbersEnd) {
  const TestScene s = cornell_room().film(64, 64);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 4), 1);
  const StageContext& context = renderer.context();
  const auto paths = static_cast<int64_t>(std::bit_ceil(
      static_cast<uint64_t>(kSuperblockSamples * light_paths_of_layer(context.light_paths, kCellPixels))));
  // Superblocks of a replicate that have numbers of one key, with four parts each.
  const int64_t end = (int64_t{1} << 32) / (4 * paths);
  int64_t superblock = 0;
  while (replicate_of(superblock) != ReplicateBlock{0, end - 1}) ++superblock;
  int64_t after = superblock;
  while (replicate_of(after) != ReplicateBlock{0, end}) ++after;
  LayerContext first, last, next, other;
  set_light_path_sampling(context, 0, 0, 0, &first);
  set_light_path_sampling(context, 1, 1, superblock, &last);
  set_light_path_sampling(context, 0, 0, after, &next);
  set_light_path_sampling(context, 0, 0, 1, &other);
  EXPECT_EQ(first.light_key, last.light_key);
  EXPECT_NE(first.first_index, last.first_index);
  EXPECT_NE(first.light_key, next.light_key);
  EXPECT_NE(first.light_key, other.light_key);
}

}  // namespace
}  // namespace lightmill::test
