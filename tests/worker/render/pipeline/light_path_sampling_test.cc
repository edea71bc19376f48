// Light paths of a superblock are one low-discrepancy point set over the film, and those of a packet one of
// their own.
#include "worker/render/pipeline/light_path_sampling.h"

#include <gtest/gtest.h>

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
    for (uint64_t cell = 0; cell < 4; ++cell) {
      LayerContext layer;
      layer.light_paths = light_paths_of_layer(context.light_paths, kCellPixels);
      set_light_path_sampling(context, cell, 3, &layer);
      std::vector<Point> packet;
      for (layer.sample_in_batch = 0; layer.sample_in_batch < kSuperblockSamples; ++layer.sample_in_batch) {
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
  for (uint64_t cell = 0; cell < 64; ++cell) {
    LayerContext layer;
    layer.light_paths = light_paths_of_layer(preview.context().light_paths, kCellPixels / 16);
    set_light_path_sampling(preview.context(), cell, 3, &layer);
    for (int i = 0; i < layer.light_paths; ++i) {
      Point p;
      layer.light_stream<float>(i).get_2d(kDimLightDirection, &p.u, &p.v);
      boxes.insert(static_cast<int>(32 * p.u) * 32 + static_cast<int>(32 * p.v));
    }
  }
  // 1024 points by chance would be in 647 of as many boxes.
  EXPECT_GT(boxes.size(), 580u);
}

// Of 2^32 paths and more, which a number has no room for, each part has a key.
TEST(LightPathSampling, HasANewKeyWhereNumbersEnd) {
  const TestScene s = cornell_room();
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 4), 1);
  LayerContext first, last, next, other;
  const uint64_t cells = (uint64_t{1} << 32) / (kSuperblockSamples * kCellPixels);
  set_light_path_sampling(renderer.context(), 0, 0, &first);
  set_light_path_sampling(renderer.context(), cells - 1, 0, &last);
  set_light_path_sampling(renderer.context(), cells, 0, &next);
  set_light_path_sampling(renderer.context(), 0, 1, &other);
  EXPECT_EQ(first.light_key, last.light_key);
  EXPECT_NE(first.first_index, last.first_index);
  EXPECT_NE(first.light_key, next.light_key);
  EXPECT_NE(first.light_key, other.light_key);
}

}  // namespace
}  // namespace lightmill::test
