// AOVs: what they say of scenes whose geometry is known, and that they change nothing else.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/job/sample_allocation.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

RenderSettings with_aovs(RenderSettings settings, Aovs aovs = kAllAovs) {
  settings.aovs = aovs;
  return settings;
}

/// A resolved film, channels by name.
struct Layers {
  Image beauty;
  ChannelImage aovs;
  explicit Layers(const Film& film) : beauty(film.resolve()), aovs(film.resolve_aovs()) {}
  Layers(const SceneDescription& scene, const RenderSettings& settings)
      : Layers([&] {
          Film film(settings.grid);
          film.fold(render_partial(scene, settings));
          return film;
        }()) {}
  float at(const std::string& channel, int x, int y) const {
    for (size_t c = 0; c < aovs.channels.size(); ++c) {
      if (aovs.channels[c] == channel) return aovs.image.pixel(x, y)[c];
    }
    ADD_FAILURE() << "no channel " << channel;
    return NAN;
  }
};

constexpr Integrator kIntegrators[] = {Integrator::kPt, Integrator::kBdpt, Integrator::kLt};

TEST(Aovs, TheColourKeepsItsBits) {
  const SceneDescription scene = cornell_room().film(40, 24).scene;
  for (const Integrator integrator : kIntegrators) {
    const RenderSettings settings = settings_for(scene, integrator, 6, 5);
    Film plain(settings.grid);
    plain.fold(render_partial(scene, settings));
    const Layers layers(scene, with_aovs(settings));
    EXPECT_EQ(plain.resolve().data, layers.beauty.data) << name_of(integrator);
    EXPECT_EQ(plain.resolve_aovs().channels.size(), 0u);
  }
}

TEST(Aovs, NobodyCanTellWhoRenderedWhat) {
  const SceneDescription scene = cornell_room().film(70, 40).scene;
  for (const Integrator integrator : kIntegrators) {
    const RenderSettings settings = with_aovs(settings_for(scene, integrator, 6, 4));
    const Partial whole = render_partial(scene, settings);
    const Partial scattered = render_partial(scene, settings, 3, PacketOrder::kScattered);
    EXPECT_EQ(whole.aovs, scattered.aovs) << name_of(integrator);
    EXPECT_EQ(partial_digest(whole), partial_digest(scattered));
    const Partial sent = decode_partial(encode_partial(whole));
    EXPECT_EQ(sent, whole);
    Film film(settings.grid);
    film.fold(sent);
    const Film restored = Film::restore(film.snapshot());
    EXPECT_EQ(film.resolve_aovs().image.data, restored.resolve_aovs().image.data);
    EXPECT_EQ(restored.resolve_aovs().channels, aov_channels(kAllAovs, {}));
  }
}

/// A wall of reflectance (.5, .25, .125) in the plane z = 3, seen along +z from z = 0; in front of its right
/// half hangs a mirror that shows a red wall behind the camera. The uppermost row of pixels sees neither.
TestScene walls() {
  TestScene s;
  const int wall = s.diffuse(Rgb{.5f, .25f, .125f}), red = s.diffuse(Rgb{.8f, 0, 0});
  s.quad({-4, -4, 3}, {0, 6, 0}, {8, 0, 0}, wall);
  s.quad({-10, -10, -2}, {20, 0, 0}, {0, 20, 0}, red);
  s.quad({.5, -4, 2}, {0, 5, 0}, {4, 0, 0}, s.conductor(1, 0));
  s.environment({1, 1, 1});
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(32, 32);
  return s;
}

TEST(Aovs, FirstHitsAreWhereTheSceneSays) {
  const TestScene s = walls();
  for (const Integrator integrator : kIntegrators) {
    const Layers l(s.scene, with_aovs(settings_for(s.scene, integrator, 16, 4)));
    // The camera may look to either hand: the wall's pixels are those at depth 3.
    int wall_x = 4, mirror_x = 28;
    if (l.at("depth.Z", wall_x, 28) < 2.5f) std::swap(wall_x, mirror_x);
    EXPECT_NEAR(l.at("depth.Z", wall_x, 28), 3, 1e-5);
    EXPECT_NEAR(l.at("position.Z", wall_x, 28), 3, 1e-5);
    EXPECT_NEAR(std::abs(l.at("position.X", wall_x, 28)), 3 * 11.5 / 16, .05);
    EXPECT_NEAR(l.at("position.Y", wall_x, 28), -3 * 12.5 / 16, .05);
    EXPECT_NEAR(l.at("normal.Z", wall_x, 28), -1, 1e-6);
    EXPECT_NEAR(l.at("albedo.R", wall_x, 28), .5, 1e-3);
    EXPECT_NEAR(l.at("albedo.G", wall_x, 28), .25, 1e-3);
    EXPECT_NEAR(l.at("albedo.B", wall_x, 28), .125, 1e-3);
    EXPECT_EQ(l.at("A", wall_x, 28), 1);
    EXPECT_EQ(l.at("samples.V", wall_x, 28), 16);
    // Through the mirror: colour and normal of what it shows, but its own depth.
    EXPECT_NEAR(l.at("depth.Z", mirror_x, 28), 2, 1e-5);
    EXPECT_NEAR(l.at("normal.Z", mirror_x, 28), 1, 1e-6);
    EXPECT_NEAR(l.at("albedo.R", mirror_x, 28), .8, 1e-3);
    EXPECT_NEAR(l.at("albedo.G", mirror_x, 28), 0, 1e-6);
    // Nothing there.
    for (const char* channel : {"A", "depth.Z", "albedo.R", "normal.Z", "position.Z"}) {
      EXPECT_EQ(l.at(channel, wall_x, 0), 0) << channel;
    }
  }
}

// A holdout hides what is behind it and is no part of the picture; what is black otherwise is.
TEST(Aovs, HoldoutsHaveNoAlpha) {
  for (const bool in_mix : {false, true}) {
    TestScene s;
    const int black = s.diffuse(0.0f);
    ClosureMaterial holdout;
    holdout.closure = ClosureKind::kHoldout;
    s.scene.materials.emplace_back().kind = holdout;
    const int held_out = static_cast<int>(s.scene.materials.size()) - 1;
    s.quad({-4, -4, 4}, {0, 8, 0}, {8, 0, 0}, black);
    s.quad({0, -4, 2}, {0, 8, 0}, {4, 0, 0}, in_mix ? s.mix(black, held_out, 0.25f) : held_out);
    s.camera({0, 0, 0}, {0, 0, 1}, 50).film(8, 8);
    const Layers layers(s.scene, with_aovs(settings_for(s.scene, Integrator::kPt, 64, 2)));
    const bool left = camera_direction(s.scene, 1, 4).x < 0;
    EXPECT_EQ(layers.at("A", left ? 1 : 6, 4), 1);
    EXPECT_NEAR(layers.at("A", left ? 6 : 1, 4), in_mix ? 0.75 : 0, 0.05);
  }
}

TEST(Aovs, PositionsAndDepthsAreThoseOfTheFileAtAnyScaleAndPlace) {
  TestScene s;
  const Vec3d eye{1e6, -2e6, 3e6};
  s.quad(eye + Vec3d{-4e3, -4e3, 3e3}, {0, 8e3, 0}, {8e3, 0, 0}, s.diffuse(.5f));
  s.environment({1, 1, 1});
  s.camera(eye, eye + Vec3d{0, 0, 1e3}, 90).film(32, 32);
  const Layers l(s.scene, with_aovs(settings_for(s.scene, Integrator::kPt, 4, 1)));
  EXPECT_NEAR(l.at("depth.Z", 10, 10), 3e3, 1e-2);
  EXPECT_NEAR(l.at("position.Z", 10, 10), 3e6 + 3e3, .5);  // a float has no more digits there
  EXPECT_NEAR(l.at("position.Y", 10, 10), -2e6 + 3e3 * 5.5 / 16, 100);
}

TEST(Aovs, DirectLightIsARenderOfOneScatteringEvent) {
  const SceneDescription scene = cornell_room().film(40, 24).scene;
  for (const Integrator integrator : kIntegrators) {
    const RenderSettings settings = with_aovs(settings_for(scene, integrator, 8, 5));
    const Layers all(scene, settings);
    const RenderSettings one = settings_for(scene, integrator, 8, 1);
    const Layers direct(scene, one);
    double indirect = 0;
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 40; ++x) {
        const float* whole = all.beauty.pixel(x, y);
        const std::string names[] = {"R", "G", "B"};
        for (size_t c = 0; c < 3; ++c) {
          const float d = all.at("direct." + names[c], x, y), i = all.at("indirect." + names[c], x, y);
          EXPECT_NEAR(d, direct.beauty.pixel(x, y)[c], 1e-5 * std::max(1.0f, whole[c]))
              << name_of(integrator);
          EXPECT_NEAR(d + i, whole[c], 1e-5 * std::max(1.0f, whole[c])) << name_of(integrator);
          EXPECT_GE(i, 0);
          indirect += i;
        }
      }
    }
    EXPECT_GT(indirect, 0) << name_of(integrator);
  }
}

TEST(Aovs, VarianceIsThatOfTheCameraSamples) {
  const SceneDescription scene = cornell_room().film(32, 32).scene;
  constexpr int kSpp = 8;
  const RenderSettings settings = with_aovs(settings_for(scene, Integrator::kPt, kSpp, 3), kAovVariance);
  const Layers layers(scene, settings);
  // The same samples one at a time: images of growing counts, whose differences are single samples.
  std::vector<Image> sums;
  for (int n = 1; n <= kSpp; ++n)
    sums.push_back(Layers(scene, settings_for(scene, Integrator::kPt, n, 3)).beauty);
  double total = 0;
  for (int y = 0; y < 32; y += 3) {
    for (int x = 0; x < 32; x += 3) {
      double mean = sums.back().pixel(x, y)[0], variance = 0, before = 0;
      for (int n = 1; n <= kSpp; ++n) {
        const double sum = double{sums[static_cast<size_t>(n) - 1].pixel(x, y)[0]} * n;
        variance += (sum - before - mean) * (sum - before - mean) / (kSpp - 1);
        before = sum;
      }
      EXPECT_NEAR(layers.at("variance.R", x, y), variance, 1e-4 * variance + 1e-6 * mean * mean);
      total += variance;
    }
  }
  EXPECT_GT(total, 0);
}

// A path that scatters in a medium hits nothing, whatever it meets afterwards.
TEST(Aovs, FogHidesWhatIsBehindIt) {
  constexpr double kSigma = 0.5, kDistance = 2;
  TestScene s;
  s.quad({-50, -50, kDistance}, {0, 100, 0}, {100, 0, 0}, s.diffuse(0.5f));
  s.environment({1, 1, 1});
  s.scene.media.push_back({"", {0, 0, 0}, {kSigma, kSigma, kSigma}, {}, 0, {}});
  s.scene.camera.medium = 0;
  s.camera({0, 0, 0}, {0, 0, 1}, 2).film(40, 40);
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
    const RenderSettings settings =
        with_aovs(settings_for(s.scene, integrator, 8, 6), kAovAlpha | kAovDepth | kAovPosition);
    const Partial whole = render_partial(s.scene, settings);
    EXPECT_EQ(whole.aovs, render_partial(s.scene, settings, 3, PacketOrder::kScattered).aovs);
    Film film(settings.grid);
    film.fold(whole);
    const Layers layers(film);
    double alpha = 0;
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) {
        alpha += layers.at("A", x, y) / 1600;
        if (layers.at("A", x, y) == 0) continue;
        ASSERT_NEAR(layers.at("depth.Z", x, y), kDistance, 1e-4);
      }
    }
    EXPECT_NEAR(alpha, std::exp(-kSigma * kDistance), 0.01);
  }
}

// What AOVs say does not depend on where samples are spent.
TEST(Aovs, OfAllocatedSamplesSayTheSame) {
  constexpr int64_t kSpp = 22;  // groups of four sample indices are cut
  TestScene s = cornell_room();
  s.scene.area_lights.back().light_group = "ceiling";
  s.point_light({-0.5, 0.4, 0.1}, {0.4f, 0.3f, 0.5f});
  const SceneDescription scene = s.film(70, 40).scene;
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
    RenderSettings settings = with_aovs(settings_for(scene, integrator, kSpp, 5));
    settings.light_groups = {"ceiling", "rest"};
    const Layers uniform(scene, settings);
    settings.plan = plan_of(settings);
    const RegionGrid regions = regions_of(settings.grid);
    settings.plan->allocation.levels = std::string(static_cast<size_t>(regions.count()), '0');
    for (int64_t i = 0; i < regions.count(); ++i)
      settings.plan->allocation.set_level(i, kLeastLevel + static_cast<int>(i * 7 % 5));
    const Renderer renderer(scene, settings, 1);
    ASSERT_TRUE(renderer.aovs().weighted);
    Film whole(settings.grid), parts(settings.grid);
    whole.fold(render_partial(renderer));
    for (const auto& [begin, end] : {std::pair{16, 22}, {5, 16}, {0, 5}}) {
      parts.fold(decode_partial(encode_partial(render_samples(renderer, begin, end))));
      parts = Film::restore(parts.snapshot());
    }
    const Layers adapted(whole), in_parts(parts);
    EXPECT_EQ(adapted.beauty.data, in_parts.beauty.data);
    double variance = 0, uniform_variance = 0, albedo = 0, uniform_albedo = 0, depth = 0, uniform_depth = 0;
    int flat = 0, differ = 0;  // pixels that see one plane; a few see a little of another by some samples
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 70; ++x) {
        SCOPED_TRACE(testing::Message() << name_of(integrator) << ' ' << x << ' ' << y);
        const int level = settings.plan->allocation.level(regions.at(x, y));
        const double samples = 4 + std::ldexp(kSpp - 4.0, level);
        ASSERT_GE(adapted.at("samples.V", x, y), std::floor(samples));
        ASSERT_LE(adapted.at("samples.V", x, y), std::ceil(samples));
        ASSERT_EQ(adapted.at("A", x, y), 1);
        for (const char* channel :
             {"samples.V", "normal.X", "albedo.R", "depth.Z", "position.Y", "variance.G", "direct.B"})
          ASSERT_EQ(adapted.at(channel, x, y), in_parts.at(channel, x, y)) << channel;
        const float colour = adapted.beauty.pixel(x, y)[0];
        ASSERT_NEAR(adapted.at("direct.R", x, y) + adapted.at("indirect.R", x, y), colour, 1e-5f * colour);
        ASSERT_NEAR(adapted.at("lightgroup_ceiling.R", x, y) + adapted.at("lightgroup_rest.R", x, y), colour,
                    1e-5f * colour);
        if (std::hypot(uniform.at("normal.X", x, y), uniform.at("normal.Y", x, y),
                       uniform.at("normal.Z", x, y)) > 1 - 1e-6f) {
          ++flat;
          differ += std::fabs(adapted.at("normal.Y", x, y) - uniform.at("normal.Y", x, y)) > 1e-5f ||
                    std::fabs(adapted.at("normal.Z", x, y) - uniform.at("normal.Z", x, y)) > 1e-5f;
          depth += adapted.at("depth.Z", x, y);
          uniform_depth += uniform.at("depth.Z", x, y);
        }
        albedo += adapted.at("albedo.R", x, y);
        uniform_albedo += uniform.at("albedo.R", x, y);
        variance += adapted.at("variance.G", x, y);
        uniform_variance += uniform.at("variance.G", x, y);
      }
    }
    EXPECT_NEAR(variance, uniform_variance, 0.2 * uniform_variance);
    EXPECT_GT(flat, 2000);
    EXPECT_LT(differ, flat / 100);
    EXPECT_NEAR(depth, uniform_depth, 1e-3 * uniform_depth);
    EXPECT_NEAR(albedo, uniform_albedo, 0.005 * uniform_albedo);
  }
}

TEST(Aovs, BytesThatNobodyWroteAreRefused) {
  const SceneDescription scene = cornell_room().film(32, 16).scene;
  const RenderSettings settings = with_aovs(settings_for(scene, Integrator::kBdpt, 2, 3));
  const Partial partial = render_partial(scene, settings);
  const std::string good = encode_aovs(partial.aovs);
  const size_t pixels = partial.camera.size();
  ASSERT_EQ(decode_aovs(good, pixels, settings.grid), partial.aovs);
  ASSERT_FALSE(partial.aovs.direct_splats.empty());
  EXPECT_LE(good.size(), max_aov_bytes(pixels, settings.grid, 0));
  for (size_t size = 0; size < good.size(); size += 1 + size / 50) {
    EXPECT_THROW(decode_aovs(std::string_view(good).substr(0, size), pixels, settings.grid), Error) << size;
  }
  EXPECT_THROW(decode_aovs(good + '\0', pixels, settings.grid), Error);
  Random random(5);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string bad = good;
    // The head and the counts are hit most: what they say is believed first.
    const size_t at = i % 2 ? random.bits() % bad.size() : random.bits() % 40;
    bad[at] = static_cast<char>(random.bits());
    try {
      const AovSums sums = decode_aovs(bad, pixels, settings.grid);
      check_aovs(sums, settings.grid, pixels, settings.spp, partial.camera, partial.splats);
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(Aovs, APartialWithOthersThanTheFilmsIsRefused) {
  const SceneDescription scene = cornell_room().film(32, 32).scene;
  const RenderSettings settings = settings_for(scene, Integrator::kPt, 1, 2);
  Film film(settings.grid);
  film.fold(render_partial(scene, with_aovs(settings, kAovAlbedo)));
  const Partial other = render_partial(scene, with_aovs(settings, kAovNormal));
  EXPECT_THROW(film.fold(other), std::exception);
  Partial lies = render_partial(scene, with_aovs(settings, kAovDirect));
  lies.aovs.layers[kDirectLayer][5] += lies.camera[5];
  lies.aovs.layers[kDirectLayer][5].c[0] += 1;
  EXPECT_THROW(encode_partial(lies), std::exception);
}

}  // namespace
}  // namespace lightmill::test
