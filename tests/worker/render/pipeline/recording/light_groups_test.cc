// Light groups: they add up to the colour, each is the light of its own lights, and they change nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/film/partial_decoder.h"
#include "common/scene/lights/scene_light_groups.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr Integrator kWithGroups[] = {Integrator::kPt, Integrator::kBdpt, Integrator::kLt};

/// A room with lights of all makes: an emitter "ceiling", a point "spark", a ball of glass, a glowing ball of
/// smoke "fire", and a lamp in no group.
TestScene lit_room() {
  TestScene s = cornell_room();
  s.scene.area_lights.back().light_group = "ceiling";
  s.point_light({-0.5, 0.4, 0.1}, {0.4f, 0.3f, 0.5f});
  s.scene.lights.back().light_group = "spark";
  s.scene.lights.push_back(
      {AreaLamp{{3, 3, 4}, translation(Vec3d{0.6, 0.8, -0.2}) * rotation(-90, {1, 0, 0}), 0.1, 0.1, false},
       {}});
  s.sphere({-0.4, -0.7, 0.3}, 0.3, s.dielectric(1.5f, 0));
  const size_t first = s.scene.shapes.size();
  s.sphere({0.4, 0.1, 0.5}, 0.3, s.diffuse(0.0f));
  s.scene.shapes[first].boundary = true;
  MediumDescription smoke{"", {1, 1, 1}, {2, 2, 2}, {3, 1.5f, 0.5f}, 0, {}};
  smoke.light_group = "fire";
  s.scene.media.push_back(smoke);
  s.scene.shapes[first].media = {0, -1};
  s.film(24, 20);
  return s;
}

RenderSettings with_groups(const SceneDescription& scene, RenderSettings settings,
                           Aovs aovs = kAovLightGroups) {
  settings.aovs = aovs;
  settings.light_groups = light_groups_of(scene);
  return settings;
}

Film film_of(const SceneDescription& scene, const RenderSettings& settings) {
  Film film(settings.grid);
  film.fold(render_partial(scene, settings));
  return film;
}

double mean_of_group(const ChannelImage& aovs, const std::string& group) {
  const auto first = std::find(aovs.channels.begin(), aovs.channels.end(), "lightgroup_" + group + ".R");
  if (first == aovs.channels.end()) return NAN;
  const auto channel = static_cast<size_t>(first - aovs.channels.begin()), stride = aovs.channels.size();
  double sum = 0;
  for (size_t i = 0; i < aovs.image.data.size(); i += stride) {
    for (size_t c = 0; c < 3; ++c) sum += double{aovs.image.data[i + channel + c]};
  }
  return sum * static_cast<double>(stride) / static_cast<double>(3 * aovs.image.data.size());
}

TEST(LightGroupLayers, AddUpToTheColour) {
  for (const bool glow : {false, true}) {
    TestScene s = lit_room();
    if (!glow) s.scene.media[0].emission = {};
    const SceneDescription& scene = s.scene;
    for (const Integrator integrator : kWithGroups) {
      const RenderSettings settings =
          with_groups(scene, settings_for(scene, integrator, 8, 6), kAovLightGroups | kAovDifference);
      ASSERT_EQ(settings.light_groups, (LightGroups{"spark", "ceiling", "fire", "rest"}));
      const Film film = film_of(scene, settings);
      const Image colour = film.resolve();
      const ChannelImage aovs = film.resolve_aovs();
      const size_t stride = aovs.channels.size();
      ASSERT_EQ(stride, 3u + 4 * 3 + 4 * 3);
      for (size_t i = 0; i < colour.data.size(); ++i) {
        const float* layers = &aovs.image.data[i / 3 * stride];
        double light = 0, difference = 0;
        for (size_t group = 0; group < 4; ++group) {
          light += double{layers[3 + 3 * group + i % 3]};
          difference += double{layers[15 + 3 * group + i % 3]};
          ASSERT_GE(layers[3 + 3 * group + i % 3], 0);
        }
        ASSERT_NEAR(light, colour.data[i], 1e-6 * colour.data[i] + 1e-12) << name_of(integrator) << ' ' << i;
        ASSERT_NEAR(difference, layers[i % 3], 1e-5 * colour.data[i] + 1e-12) << i;
      }
      for (const std::string& group : settings.light_groups) {
        // Only camera paths find what an even medium emits.
        const bool shines = group != "fire" || (glow && integrator != Integrator::kLt);
        EXPECT_EQ(mean_of_group(aovs, group) > 0, shines) << name_of(integrator) << ' ' << group;
      }
    }
  }
}

TEST(LightGroupLayers, LeaveTheColourItsBits) {
  const SceneDescription scene = lit_room().scene;
  for (const Integrator integrator : kWithGroups) {
    // Without groups, but with a camera layer.
    RenderSettings settings = settings_for(scene, integrator, 4, 6);
    settings.aovs = kAovSamples;
    EXPECT_EQ(film_of(scene, settings).resolve().data,
              film_of(scene, with_groups(scene, settings)).resolve().data)
        << name_of(integrator);
  }
}

TEST(LightGroupLayers, DoNotDependOnWhoRenderedWhat) {
  const SceneDescription scene = lit_room().film(70, 40).scene;
  for (const Integrator integrator : kWithGroups) {
    const RenderSettings settings =
        with_groups(scene, settings_for(scene, integrator, 20, 4), kAovLightGroups | kAovDifference);
    const Partial whole = render_partial(scene, settings);
    EXPECT_EQ(partial_digest(whole),
              partial_digest(render_partial(scene, settings, 3, PacketOrder::kScattered)));
    const Partial sent = decode_partial(encode_partial(whole));
    EXPECT_EQ(sent, whole);
    // In parts, and through a snapshot.
    const Renderer renderer(scene, settings, 1);
    Film parts(settings.grid);
    for (const auto& [begin, end] : {std::pair{16, 20}, {8, 16}, {0, 1}, {1, 8}}) {
      parts.fold(render_samples(renderer, begin, end));
      parts = Film::restore(parts.snapshot());
    }
    Film in_order(settings.grid);
    for (const auto& [begin, end] : {std::pair{0, 1}, {1, 8}, {8, 16}, {16, 20}})
      in_order.fold(render_samples(renderer, begin, end));
    EXPECT_EQ(parts.resolve().data, in_order.resolve().data);
    const ChannelImage a = parts.resolve_aovs(), b = in_order.resolve_aovs();
    ASSERT_EQ(a.channels, b.channels);
    for (const std::string& group : settings.light_groups)
      EXPECT_EQ(mean_of_group(a, group), mean_of_group(b, group));
  }
}

TEST(LightGroupLayers, AreShownAsTheImageIs) {
  const SceneDescription scene = lit_room().film(70, 40).scene;
  for (const Integrator integrator : kWithGroups) {
    const RenderSettings settings = with_groups(scene, settings_for(scene, integrator, 4, 4));
    const Film film = film_of(scene, settings);
    const ChannelImage shown = film.light_groups_for_display(1), aovs = film.resolve_aovs();
    const Image image = film.resolve();
    ASSERT_EQ(shown.channels.size(), 3u + aovs.channels.size());
    EXPECT_EQ(shown.channels[0], "R");
    EXPECT_TRUE(std::equal(aovs.channels.begin(), aovs.channels.end(), shown.channels.begin() + 3));
    const size_t stride = shown.channels.size();
    for (size_t i = 0; i < image.data.size() / 3; ++i) {
      const float* pixel = &shown.image.data[i * stride];
      ASSERT_TRUE(std::equal(pixel, pixel + 3, &image.data[3 * i])) << i;
      ASSERT_TRUE(std::equal(pixel + 3, pixel + stride, &aovs.image.data[i * (stride - 3)])) << i;
    }
    // In blocks they are means; 70 x 40 pixels end within a block of 3 x 3.
    const ChannelImage small = film.light_groups_for_display(3);
    const Image means = reduced(shown.image, 24);
    ASSERT_EQ(small.image.width, means.width);
    ASSERT_EQ(small.image.height, means.height);
    for (size_t i = 0; i < means.data.size(); ++i)
      ASSERT_NEAR(small.image.data[i], means.data[i], 1e-5 * means.data[i] + 1e-12) << i;
  }
}

TEST(LightGroupLayers, AreFilledInWhileTilesAreMissing) {
  const SceneDescription scene = lit_room().film(70, 40).scene;
  for (const Integrator integrator : kWithGroups) {
    const RenderSettings settings = with_groups(scene, settings_for(scene, integrator, 4, 4));
    const Renderer renderer(scene, settings, 1);
    Film film(settings.grid);
    EXPECT_TRUE(film.light_groups_for_display(1).channels.empty()) << "nothing is known of it yet";
    film.fold(render_cells(renderer, {0, 0, 1, 1}));
    for (const int block : {1, 2}) {
      const ChannelImage shown = film.light_groups_for_display(block);
      const size_t stride = shown.channels.size();
      double sum = 0;
      for (size_t i = 0; i < shown.image.data.size(); i += stride) {
        for (size_t c = 0; c < 3; ++c) {
          const float* pixel = &shown.image.data[i + c];
          double light = 0;
          for (size_t group = 1; group < stride / 3; ++group) light += double{pixel[3 * group]};
          ASSERT_NEAR(light, *pixel, 1e-5 * *pixel + 1e-9) << name_of(integrator) << ' ' << i;
          sum += double{*pixel};
        }
      }
      EXPECT_GT(sum, 0);
      if (block == 1) {
        const Image image = film.resolve_for_display();
        for (size_t i = 0; i < image.data.size(); ++i)
          ASSERT_EQ(shown.image.data[i / 3 * stride + i % 3], image.data[i]) << i;
      }
    }
  }
}

// The oracle: with the others dark, the colour is a group's light.
TEST(LightGroupLayers, AreTheLightOfTheirLightsAlone) {
  const SceneDescription scene = lit_room().scene;
  for (const Integrator integrator : kWithGroups) {
    const RenderSettings settings = with_groups(scene, settings_for(scene, integrator, 64, 4));
    const Renderer all(scene, settings, 1);
    std::vector<std::vector<double>> means(4);
    for (uint64_t seed = 1; seed <= 16; ++seed) {
      RenderSettings seeded = settings;
      seeded.seed = seed;
      Film film(settings.grid);
      film.fold(render_partial(Renderer(all, seeded)));
      const ChannelImage aovs = film.resolve_aovs();
      for (size_t i = 0; i < 4; ++i) means[i].push_back(mean_of_group(aovs, settings.light_groups[i]));
    }
    for (size_t i = 0; i < 4; ++i) {
      const std::string& group = settings.light_groups[i];
      SceneDescription alone = scene;
      const auto keeps = [&](const std::string& of) { return (of.empty() ? kRestGroup : of) == group; };
      std::erase_if(alone.lights, [&](const LightDescription& l) { return !keeps(l.light_group); });
      for (AreaLightDescription& l : alone.area_lights) {
        if (!keeps(l.light_group)) l.radiance = {};
      }
      if (!keeps(alone.media[0].light_group)) alone.media[0].emission = {};
      RenderSettings plain = settings;
      plain.aovs = 0;
      plain.light_groups = {};
      EXPECT_TRUE(means_agree(estimate(means[i]), mean_over_seeds(Renderer(alone, plain, 1), plain),
                              {.resolution = 0.1}))
          << name_of(integrator) << ' ' << group;
    }
  }
}

TEST(LightGroupLayers, OfASceneWithoutGroupsAreNone) {
  const SceneDescription scene = cornell_room().scene;
  const RenderSettings settings = with_groups(scene, settings_for(scene, Integrator::kBdpt, 1, 3));
  EXPECT_TRUE(settings.light_groups.empty());
  EXPECT_TRUE(film_of(scene, settings).resolve_aovs().channels.empty());
}

TEST(LightGroupLayers, OneGroupOfAllLightsIsTheColour) {
  TestScene s = cornell_room();
  s.scene.area_lights.back().light_group = "only";
  const RenderSettings settings = with_groups(s.scene, settings_for(s.scene, Integrator::kBdpt, 2, 3));
  ASSERT_EQ(settings.light_groups, LightGroups{"only"});
  const Film film = film_of(s.scene, settings);
  EXPECT_EQ(film.resolve_aovs().image.data, film.resolve().data);
}

TEST(LightGroupLayers, TooManyAreLeftToTheRest) {
  TestScene s = cornell_room();
  s.scene.area_lights.back().light_group = "area";
  for (int i = 0; i < 40; ++i) {
    s.point_light({0.02 * i - 0.4, 0.4, 0.1}, {0.1f, 0.1f, 0.1f});
    s.scene.lights.back().light_group = "g" + std::to_string(i);
  }
  const RenderSettings settings = with_groups(s.scene, settings_for(s.scene, Integrator::kPt, 2, 3));
  ASSERT_EQ(settings.light_groups.size(), kMaxLightGroups);
  EXPECT_EQ(settings.light_groups.back(), kRestGroup);
  const Renderer renderer(s.scene, settings, 1);
  const std::vector<std::string> warnings = renderer.warnings();
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& line) {
    return line.find("10 are left to the group \"rest\"") != std::string::npos;
  }));
  const ChannelImage aovs = film_of(s.scene, settings).resolve_aovs();
  for (const std::string& group : settings.light_groups) EXPECT_GT(mean_of_group(aovs, group), 0) << group;
}

TEST(LightGroupLayers, OfAnotherSceneAreRefused) {
  const SceneDescription scene = lit_room().scene;
  RenderSettings settings = with_groups(scene, settings_for(scene, Integrator::kPt, 1, 2));
  const std::string bytes = encode_partial(render_partial(scene, settings));
  PartialDecoder decoder;
  const TileSpec tile = decode_partial(bytes).tile;
  EXPECT_EQ(decoder.decode(bytes, settings.grid, tile, 4).aovs.groups.size(), 3u);
  EXPECT_THROW(decoder.decode(bytes, settings.grid, tile, 3), Error);
  settings.light_groups = {"spark", "rest"};
  EXPECT_THROW(Renderer(scene, settings, 1), Error);
}

}  // namespace
}  // namespace lightmill::test
