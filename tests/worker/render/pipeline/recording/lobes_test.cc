// Lobes: they add up to the colour, are what the first event was whatever strategy finds it, and change
// nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/film/partial_decoder.h"
#include "common/job/sample_allocation.h"
#include "common/scene/lights/scene_light_groups.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr Integrator kWithLobes[] = {Integrator::kPt, Integrator::kBdpt, Integrator::kLt};

int add_kind(TestScene* s, MaterialKind kind) {
  s->scene.materials.push_back({"", std::move(kind), {}});
  return static_cast<int>(s->scene.materials.size()) - 1;
}

/// Plastic: diffuse and glossy at once.
MetallicRoughnessMaterial plastic(const Rgb& base) {
  MetallicRoughnessMaterial m;
  m.base_color.value = base;
  m.metallic.value = 0;
  m.roughness.value = 0.5f;
  return m;
}

/// A room whose things have all lobes that light tracing can see, lit by emitters so large that hits find
/// them, too.
TestScene room_of_lobes() {
  TestScene s = cornell_room();
  s.scene.area_lights.back().radiance = {2, 1.8f, 1.5f};
  s.quad({-0.98, -0.4, -0.4}, {0, 0.8, 0}, {0, 0, 0.8}, s.diffuse(0.0f), {.radiance = {2, 2.4f, 3}});
  s.sphere({-0.5, -0.6, 0.2}, 0.3, add_kind(&s, plastic({0.7f, 0.3f, 0.2f})));
  s.sphere({0.5, -0.6, 0.0}, 0.3, s.coated({0.2f, 0.3f, 0.7f}, 1.5f, 0.3f));
  s.sphere({-0.45, 0.2, 0.3}, 0.25, s.dielectric(1.5f, 0.4f));
  // A sheet that is lit from behind.
  s.quad({0.45, 0.15, 0.3}, {0.4, 0, 0}, {0, 0.3, -0.3},
         s.diffuse_transmission({0.3f, 0.3f, 0.2f}, {0.5f, 0.4f, 0.2f}));
  PrincipledMaterial principled;
  principled.base_color.value = {0.2f, 0.6f, 0.3f};
  principled.roughness.value = 0.4f;
  s.sphere({0.0, -0.1, 0.6}, 0.25, add_kind(&s, principled));
  s.film(20, 16);
  return s;
}

/// The same with a ball of smoke, a mirror, clear glass, lacquer and wax, and lights of other makes.
TestScene room_of_all_sorts() {
  TestScene s = room_of_lobes();
  s.sphere({-0.1, 0.55, 0.4}, 0.2, s.dielectric(1.5f, 0));
  s.sphere({-0.75, -0.1, 0.5}, 0.2, s.conductor(0.9f, 0));
  s.sphere({0.75, 0.55, 0.4}, 0.2, s.coated({0.6f, 0.2f, 0.2f}, 1.5f, 0));
  SubsurfaceMaterial wax;
  wax.sigma_a = {0.1f, 0.2f, 0.4f};
  wax.sigma_s = {8, 8, 8};
  s.sphere({-0.7, 0.6, 0.4}, 0.2, add_kind(&s, wax));
  s.point_light({-0.5, 0.4, 0.1}, {0.4f, 0.3f, 0.5f});
  const size_t first = s.scene.shapes.size();
  s.sphere({0.2, 0.2, -0.1}, 0.2, s.diffuse(0.0f));
  s.scene.shapes[first].boundary = true;
  s.scene.media.push_back({"", {0.5f, 0.5f, 0.5f}, {3, 3, 3}, {0.3f, 0.2f, 0.1f}, 0.3f, {}});
  s.scene.shapes[first].media = {0, -1};
  return s;
}

RenderSettings with_lobes(RenderSettings settings, Aovs aovs = kAovLobes) {
  settings.aovs = aovs;
  return settings;
}

Film lobe_film(const SceneDescription& scene, const RenderSettings& settings) {
  Film film(settings.grid);
  film.fold(render_partial(scene, settings));
  return film;
}

size_t channel_of(const ChannelImage& aovs, const std::string& name) {
  const auto found = std::find(aovs.channels.begin(), aovs.channels.end(), name);
  EXPECT_NE(found, aovs.channels.end()) << name;
  return static_cast<size_t>(found - aovs.channels.begin());
}

using LobeMeans = std::array<double, kLobeParts>;

LobeMeans means_of(const ChannelImage& aovs) {
  LobeMeans means{};
  const size_t stride = aovs.channels.size(), pixels = aovs.image.data.size() / stride;
  for (size_t part = 0; part < kLobeParts; ++part) {
    const size_t first = channel_of(aovs, std::string(kLobeNames[part]) + ".R");
    for (size_t i = 0; i < pixels; ++i) {
      for (size_t c = 0; c < 3; ++c) means[part] += double{aovs.image.data[i * stride + first + c]};
    }
    means[part] /= static_cast<double>(3 * pixels);
  }
  return means;
}

std::array<Estimate, kLobeParts> lobes_over_seeds(const Renderer& world, RenderSettings settings) {
  std::array<std::vector<double>, kLobeParts> values;
  for (settings.seed = 1; settings.seed <= 16; ++settings.seed) {
    Film film(settings.grid);
    film.fold(render_partial(Renderer(world, settings)));
    const LobeMeans means = means_of(film.resolve_aovs());
    for (size_t part = 0; part < kLobeParts; ++part) values[part].push_back(means[part]);
  }
  std::array<Estimate, kLobeParts> estimates;
  for (size_t part = 0; part < kLobeParts; ++part) estimates[part] = estimate(values[part]);
  return estimates;
}

TEST(Lobes, AddUpToTheColour) {
  const SceneDescription scene = room_of_all_sorts().scene;
  for (const Integrator integrator : kWithLobes) {
    const RenderSettings settings =
        with_lobes(settings_for(scene, integrator, 8, 6), kAovLobes | kAovDirect | kAovIndirect);
    const Film film = lobe_film(scene, settings);
    const Image colour = film.resolve();
    const ChannelImage aovs = film.resolve_aovs();
    const size_t stride = aovs.channels.size(), first = channel_of(aovs, "diffuse_direct.R"),
                 direct = channel_of(aovs, "direct.R");
    for (size_t i = 0; i < colour.data.size(); ++i) {
      const float* layers = &aovs.image.data[i / 3 * stride];
      const double whole = colour.data[i];
      double light = 0, direct_light = 0;
      for (size_t part = 0; part < kLobeParts; ++part) {
        const double value = layers[first + 3 * part + i % 3];
        ASSERT_GE(value, 0) << name_of(integrator) << ' ' << kLobeNames[part];
        light += value;
        if (part % 2 == 0) direct_light += value;
      }
      ASSERT_NEAR(light, whole, 1e-6 * whole + 1e-12) << name_of(integrator) << ' ' << i;
      ASSERT_NEAR(direct_light, layers[direct + i % 3], 1e-5 * whole + 1e-12)
          << name_of(integrator) << ' ' << i;
    }
    const LobeMeans means = means_of(aovs);
    for (size_t part = 0; part < kLobeParts; ++part) {
      if (integrator == Integrator::kLt) continue;
      EXPECT_GT(means[part], 0) << kLobeNames[part];
    }
  }
}

TEST(Lobes, AddUpUnderFiltersSensorsAndWeights) {
  for (const FilterKind filter : {FilterKind::kGaussian, FilterKind::kMitchell}) {
    TestScene s = room_of_all_sorts();
    s.scene.filter = {.kind = filter};
    s.scene.film.sensor = {0.9, -0.2, 0, 0, 1.1, -0.1, 0.2, 0, 1.5};
    for (const Integrator integrator : kWithLobes) {
      RenderSettings settings = with_lobes(settings_for(s.scene, integrator, 20, 5));
      if (integrator != Integrator::kLt) {
        settings.plan = plan_of(settings);
        const RegionGrid regions = regions_of(settings.grid);
        settings.plan->allocation.levels = std::string(static_cast<size_t>(regions.count()), '0');
        for (int64_t i = 0; i < regions.count(); ++i)
          settings.plan->allocation.set_level(i, kLeastLevel + static_cast<int>(i * 7 % 5));
      }
      const Film film = lobe_film(s.scene, settings);
      const Image colour = film.resolve();
      const ChannelImage aovs = film.resolve_aovs();
      for (size_t i = 0; i < colour.data.size(); ++i) {
        double light = 0, size = 0;
        for (size_t part = 0; part < kLobeParts; ++part) {
          const double value = aovs.image.data[i / 3 * aovs.channels.size() + 3 * part + i % 3];
          light += value;
          size += std::abs(value);
        }
        ASSERT_NEAR(light, colour.data[i], 1e-6 * size + 1e-12) << name_of(integrator) << ' ' << i;
      }
    }
  }
}

TEST(Lobes, LeaveTheColourItsBits) {
  TestScene s = room_of_all_sorts();
  s.scene.area_lights.back().light_group = "ceiling";
  for (const Integrator integrator : kWithLobes) {
    // Without lobes, but with a camera layer.
    RenderSettings settings = with_lobes(settings_for(s.scene, integrator, 4, 6), kAovSamples);
    const std::vector<float> plain = lobe_film(s.scene, settings).resolve().data;
    EXPECT_EQ(plain, lobe_film(s.scene, with_lobes(settings)).resolve().data) << name_of(integrator);
    // Nor do they and light groups know of each other.
    settings.light_groups = light_groups_of(s.scene);
    const Film groups = lobe_film(s.scene, with_lobes(settings, kAovLightGroups)),
               both = lobe_film(s.scene, with_lobes(settings, kAovLightGroups | kAovLobes));
    EXPECT_EQ(plain, both.resolve().data) << name_of(integrator);
    const ChannelImage a = groups.resolve_aovs(), b = both.resolve_aovs();
    for (size_t i = 0; i < a.image.data.size(); ++i) {
      const size_t width = a.channels.size();
      ASSERT_EQ(a.image.data[i], b.image.data[i / width * b.channels.size() + i % width]) << i;
    }
  }
}

TEST(Lobes, DoNotDependOnWhoRenderedWhat) {
  const SceneDescription scene = room_of_all_sorts().film(70, 40).scene;
  for (const Integrator integrator : kWithLobes) {
    const RenderSettings settings =
        with_lobes(settings_for(scene, integrator, 20, 4), kAovLobes | kAovDifference);
    const Partial whole = render_partial(scene, settings);
    EXPECT_EQ(partial_digest(whole),
              partial_digest(render_partial(scene, settings, 3, PacketOrder::kScattered)));
    const Partial sent = decode_partial(encode_partial(whole));
    EXPECT_EQ(sent, whole);
    // In parts, and through a snapshot.
    const Renderer renderer(scene, settings, 1);
    Film parts(settings.grid), in_order(settings.grid);
    for (const auto& [begin, end] : {std::pair{16, 20}, {8, 16}, {0, 1}, {1, 8}}) {
      parts.fold(render_samples(renderer, begin, end));
      parts = Film::restore(parts.snapshot());
    }
    for (const auto& [begin, end] : {std::pair{0, 1}, {1, 8}, {8, 16}, {16, 20}})
      in_order.fold(render_samples(renderer, begin, end));
    EXPECT_EQ(means_of(parts.resolve_aovs()), means_of(in_order.resolve_aovs())) << name_of(integrator);
  }
}

// The oracle: what a lobe has does not depend on how its light is found.
TEST(Lobes, AreTheSameForAllStrategies) {
  const SceneDescription scene = room_of_lobes().scene;
  const auto settings_of = [&](Integrator integrator, Strategies strategies) {
    RenderSettings settings = with_lobes(settings_for(scene, integrator, 64, 4));
    settings.plan = SamplingPlan{.strategies = strategies};
    if (strategies == kEmissionHits) settings.spp = 256;  // the noisiest
    return settings;
  };
  const std::array sets = {
      settings_of(Integrator::kBdpt, kEmissionHits | kNextEvent),
      settings_of(Integrator::kBdpt, kEmissionHits),
      settings_of(Integrator::kBdpt, kAllStrategies),
      settings_of(Integrator::kLt, kLightTracing),
      settings_of(Integrator::kBdpt, kEmissionHits | kNextEvent | kVertexConnections),
  };
  const Renderer world(scene, sets[0], 1);
  const auto expected = lobes_over_seeds(world, sets[0]);
  for (size_t i = 1; i < sets.size(); ++i) {
    const auto found = lobes_over_seeds(world, sets[i]);
    for (size_t part = 0; part < kLobeParts; ++part) {
      if (part == kVolumeDirect || part == kVolumeIndirect) continue;
      EXPECT_TRUE(means_agree(expected[part], found[part], {.resolution = 0.3}))
          << strategy_names(plan_of(sets[i]).strategies) << ' ' << kLobeNames[part];
    }
  }
}

// Sharp lobes, bodies and media, which light tracing does not see directly, by what goes together.
TEST(Lobes, AreTheSameWithSharpLobesBodiesAndMedia) {
  TestScene s = room_of_all_sorts();
  s.scene.lights.clear();
  const RenderSettings pt = with_lobes(settings_for(s.scene, Integrator::kPt, 128, 4)),
                       bdpt = with_lobes(settings_for(s.scene, Integrator::kBdpt, 128, 4));
  const Renderer by_camera(s.scene, pt, 1), both_ways(s.scene, bdpt, 1);
  const auto a = lobes_over_seeds(by_camera, pt), b = lobes_over_seeds(both_ways, bdpt);
  for (size_t part = 0; part < kLobeParts; ++part)
    EXPECT_TRUE(means_agree(a[part], b[part], {.resolution = 0.3})) << kLobeNames[part];
}

/// A wall that fills the picture, lit by an emitter beside the camera.
SceneDescription wall_of(const std::function<int(TestScene*)>& material) {
  TestScene s;
  s.quad({-4, -4, 3}, {0, 8, 0}, {8, 0, 0}, material(&s));
  s.quad({1, -1, -0.5}, {2, 0, 0}, {0, 2, 0}, s.diffuse(0.0f), {.radiance = {3, 3, 3}, .two_sided = true});
  s.camera({0, 0, 0}, {0, 0, 1}, 60).film(8, 8);
  return s.scene;
}

TEST(Lobes, ArePartsOfOneEvent) {
  const auto means = [](const SceneDescription& scene, int max_depth) {
    return means_of(
        lobe_film(scene, with_lobes(settings_for(scene, Integrator::kPt, 16, max_depth))).resolve_aovs());
  };
  // One event, of one lobe.
  for (const auto& [material, part] :
       std::initializer_list<std::pair<std::function<int(TestScene*)>, size_t>>{
           {[](TestScene* s) { return s->diffuse(0.5f); }, kDiffuseDirect},
           {[](TestScene* s) { return s->conductor(0.9f, 0.3f); }, kGlossyDirect},
           {[](TestScene* s) { return s->conductor(0.9f, 0); }, kGlossyDirect}}) {
    const LobeMeans found = means(wall_of(material), 1);
    for (size_t i = 0; i < kLobeParts; ++i) EXPECT_EQ(found[i] > 0, i == part) << kLobeNames[i];
  }
  // An emitter alone.
  const LobeMeans bare =
      means(TestScene().environment({1, 2, 3}).camera({0, 0, 0}, {0, 0, 1}, 60).film(8, 8).scene, 3);
  EXPECT_NEAR(bare[kEmission], 2, 1e-5);
  EXPECT_EQ(std::accumulate(bare.begin(), bare.end() - 1, 0.0), 0);
}

// The oracle: what plastic reflects glossily does not depend on the colour below.
TEST(Lobes, OfPlasticAreItsBaseAndItsGloss) {
  const auto wall = [](const Rgb& base) {
    return wall_of([&](TestScene* s) { return add_kind(s, plastic(base)); });
  };
  const auto lobes = [](const SceneDescription& scene) {
    const RenderSettings settings = with_lobes(settings_for(scene, Integrator::kPt, 64, 1));
    return lobes_over_seeds(Renderer(scene, settings, 1), settings);
  };
  const auto white = lobes(wall({1, 1, 1})), black = lobes(wall({0, 0, 0})),
             grey = lobes(wall({0.25f, 0.25f, 0.25f}));
  EXPECT_TRUE(means_agree(white[kGlossyDirect], black[kGlossyDirect], {.resolution = 0.05}));
  EXPECT_EQ(black[kDiffuseDirect].mean, 0);
  Estimate quarter = white[kDiffuseDirect];
  quarter.mean *= 0.25;
  quarter.standard_error *= 0.25;
  EXPECT_TRUE(means_agree(quarter, grey[kDiffuseDirect], {.resolution = 0.05}));
}

TEST(Lobes, ThatNobodyAskedForAreRefused) {
  const SceneDescription scene = cornell_room().film(16, 16).scene;
  const RenderSettings settings = with_lobes(settings_for(scene, Integrator::kBdpt, 1, 2));
  const std::string bytes = encode_partial(render_partial(scene, settings));
  PartialDecoder decoder;
  const TileSpec tile = decode_partial(bytes).tile;
  EXPECT_EQ(decoder.decode(bytes, settings.grid, tile).aovs.lobes.size(), size_t{kLobeParts} - 1);
  EXPECT_THROW(decoder.decode(bytes, settings.grid, tile, kMaxLightGroups, kAllAovs & ~kAovLobes), Error);
}

}  // namespace
}  // namespace lightmill::test
