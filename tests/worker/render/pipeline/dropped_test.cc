// What the stages drop is counted by kind, and the share of the image is right: the same random numbers are
// rendered with sums of another range.
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "common/film/film.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/pipeline.h"

namespace lightmill::test {
namespace {

Partial render_with_quantum(const Renderer& renderer, int quantum_exponent) {
  const RenderSettings& s = renderer.settings();
  const TileSpec tile{s.grid.cells(), 0, s.spp};
  PartialBuilder builder(s.grid, tile, quantum_exponent, renderer.has_camera_layer(),
                         renderer.has_splat_layer());
  const auto w = std::make_unique<Wavefront>();
  for (int64_t block = 0; block < block_count(s.spp); ++block) {
    for (int cy = tile.cells.y0; cy < tile.cells.y1; ++cy) {
      for (int cx = tile.cells.x0; cx < tile.cells.x1; ++cx) {
        const Packet packet{cx, cy, block_begin(block), std::min(block_end(block), s.spp)};
        render_packet(renderer.context(), packet, quantum_exponent, *w, &builder);
      }
    }
  }
  return builder.take();
}

double mean_of(const Partial& partial) {
  Film film(partial.grid);
  film.fold(partial);
  return film.mean_magnitude();
}

DroppedShare share_of(const Partial& partial, DropKind kind) {
  const int64_t samples = partial.grid.pixels(partial.tile.cells).area() * partial.tile.samples();
  return shares_of(partial.dropped, samples, mean_of(partial))[static_cast<size_t>(kind)];
}

constexpr int kOrdinary = -52;

class DroppedRender : public ::testing::TestWithParam<Integrator> {};

// The room's lamp is beyond the range, the light that it sheds is within. With light paths the lamp is also
// splatted, in other sizes.
TEST_P(DroppedRender, TheShareOfWhatIsTooBrightIsRight) {
  TestScene s = cornell_room();
  s.film(40, 40);
  const Renderer renderer(s.scene, settings_for(s.scene, GetParam(), 64, 3), 1);
  const Partial whole = render_with_quantum(renderer, kOrdinary);
  EXPECT_FALSE(whole.dropped.any());
  const double mean = mean_of(whole);
  bool some = false;
  for (int bits = -14; bits <= 6; bits += 2) {
    const Partial part = render_with_quantum(renderer, bits - kMaxContributionBits);
    const DroppedShare dropped = share_of(part, DropKind::kOutOfRange);
    EXPECT_EQ(part.counters.nonfinite, part.dropped.refused());
    EXPECT_EQ(dropped.count, part.dropped.refused());
    if (dropped.count == 0) continue;
    const double lost = 1 - mean_of(part) / mean;
    EXPECT_NEAR(*dropped.share, lost, 0.01 * lost) << bits;
    some |= lost > 0.01 && lost < 0.9;
  }
  EXPECT_TRUE(some);
}

INSTANTIATE_TEST_SUITE_P(Integrators, DroppedRender,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

TEST(DroppedLight, BelowTheRangeAllIsBlack) {
  TestScene s;
  s.box({-3, -2, -4}, {3, 2, 4}, s.diffuse(0), {.radiance = {0.1f, 0.2f, 0.1f}, .inward = true});
  s.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(8, 8);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0), 1);
  const Partial black = render_with_quantum(renderer, 0);
  EXPECT_EQ(black.dropped.of(DropKind::kBelowRange).count, 8u * 8 * 4);
  EXPECT_NEAR(black.dropped.of(DropKind::kBelowRange).amount / (8 * 8 * 4), 0.4 / 3, 1e-5);
  EXPECT_EQ(share_of(black, DropKind::kBelowRange).share, 1);
  EXPECT_EQ(black.counters.nonfinite, 0u);
}

TEST(DroppedLight, WhatTheFilmsLimitTakesIsCounted) {
  TestScene s;
  s.box({-3, -2, -4}, {3, 2, 4}, s.diffuse(0), {.radiance = {0, 2, 0}, .inward = true});
  s.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(8, 8);
  s.scene.film.most = 0.5;
  const Partial capped = render_partial(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0));
  const DroppedShare share = share_of(capped, DropKind::kCapped);
  EXPECT_EQ(share.count, 8u * 8 * 4);
  EXPECT_NEAR(*share.share, 1 - 0.5 / 0.7151687 / 2, 1e-4);
  s.scene.film.most = 5;
  EXPECT_FALSE(render_partial(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0)).dropped.any());
}

TEST(DroppedLight, OneThatIsNotFiniteTakesNoOtherWithIt) {
  const auto w = std::make_unique<Wavefront>();
  std::fill_n(w->slots.weight, kWavefront, 0.25f);
  for (float* radiance : {w->radiance_r, w->radiance_g, w->radiance_b})
    std::fill_n(radiance, kWavefront, 0.0f);
  const float values[][3] = {{1, 2, 3},
                             {1, std::numeric_limits<float>::quiet_NaN(), 1},
                             {std::numeric_limits<float>::infinity(), 1, 1},
                             {3e38f, 3e38f, 0}};  // finite, if its sum is not
  ShadowRays& q = w->shadow;
  for (const auto& value : values) {
    q.r[q.count] = value[0], q.g[q.count] = value[1], q.b[q.count] = value[2];
    q.target[q.count] = q.count == 3 ? 8 : 7;
    q.occluded[q.count++] = 0;
  }
  film_add_to_paths(*w);
  EXPECT_EQ(w->radiance_r[7], 1);
  EXPECT_EQ(w->radiance_g[7], 2);
  EXPECT_EQ(w->radiance_b[7], 3);
  EXPECT_EQ(w->radiance_r[8], 3e38f);
  EXPECT_EQ(w->counters.nonfinite, 2u);
  EXPECT_EQ(w->dropped.of(DropKind::kNotFinite), (Dropped::Kind{2, 0.5}));
}

// A sensor's negative colours under a film that knows of them are no loss, nor are large numbers, which the
// sums' scale follows; one beyond floats is.
TEST(DroppedLight, ASensorBeyondTheRangeIsCounted) {
  TestScene s;
  s.box({-3, -2, -4}, {3, 2, 4}, s.diffuse(0), {.radiance = {1, 2, 4}, .inward = true});
  s.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(8, 8);
  s.scene.film.sensor = {0.9, -0.2, 0, 0, 1.1, -0.1, 0, 0, 1.5};
  EXPECT_FALSE(render_partial(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0)).dropped.any());
  s.scene.film.sensor = {1e20, 0, 0, 0, 1, 0, 0, 0, 1};
  EXPECT_FALSE(render_partial(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0)).dropped.any());
  s.scene.film.sensor = {3e38, 0, 0, 0, 3e38, 0, 0, 0, 1};
  const Partial lost = render_partial(s.scene, settings_for(s.scene, Integrator::kPt, 4, 0));
  EXPECT_EQ(lost.dropped.of(DropKind::kNotFinite).count, 8u * 8 * 4);
  EXPECT_EQ(lost.counters.nonfinite, 8u * 8 * 4);
  EXPECT_EQ(share_of(lost, DropKind::kNotFinite).share, 1);
}

}  // namespace
}  // namespace lightmill::test
