// AOVs of the first surface, in scenes whose surfaces are known: texture coordinates, numbers of things,
// albedo by diffuse and specular lobes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "common/film/film.h"
#include "common/job/sample_allocation.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

/// A resolved film's AOVs by name.
class SurfaceLayers {
 public:
  explicit SurfaceLayers(const Film& film) : aovs_(film.resolve_aovs()) {}
  SurfaceLayers(const SceneDescription& scene, RenderSettings settings, Aovs asked)
      : SurfaceLayers([&] {
          settings.aovs = asked;
          Film film(settings.grid);
          film.fold(render_partial(scene, settings));
          return film;
        }()) {}
  float at(const std::string& channel, int x, int y) const {
    for (size_t c = 0; c < aovs_.channels.size(); ++c) {
      if (aovs_.channels[c] == channel) return aovs_.image.pixel(x, y)[c];
    }
    ADD_FAILURE() << "no channel " << channel;
    return NAN;
  }

 private:
  ChannelImage aovs_;
};

/// A quad in the plane z = 3 that fills half of the film, seen along +z; u runs from -1 to 3 along its first
/// side, v from 10 to 10.5 along the second.
TestScene unwrapped_quad() {
  TestScene s;
  s.quad({-1.5, -1.5, 3}, {0, 3, 0}, {3, 0, 0}, s.diffuse(0.5f));
  auto& mesh = std::get<MeshShape>(s.scene.shapes.back().kind).mesh;
  auto unwrapped = std::make_shared<TriangleMesh>(*mesh);
  unwrapped->uvs = {{-1, 10}, {3, 10}, {3, 10.5}, {-1, 10.5}};
  mesh = unwrapped;
  s.environment({1, 1, 1});
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(32, 32);
  return s;
}

TEST(SurfaceAovs, TextureCoordinatesOfAQuad) {
  const TestScene s = unwrapped_quad();
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const SurfaceLayers l(s.scene, settings_for(s.scene, integrator, 16, 3),
                          kAovUv | kAovPosition | kAovAlpha);
    int hit = 0, partly = 0;
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 32; ++x) {
        const float alpha = l.at("A", x, y);
        if (alpha == 0) {
          ASSERT_EQ(l.at("uv.U", x, y), 0);
          ASSERT_EQ(l.at("uv.V", x, y), 0);
          continue;
        }
        // Both are means over the same samples, and one is linear in the other.
        ++hit, partly += alpha < 1;
        ASSERT_NEAR(l.at("uv.U", x, y), -1 + 4 * (l.at("position.Y", x, y) + 1.5) / 3, 1e-5);
        ASSERT_NEAR(l.at("uv.V", x, y), 10 + 0.5 * (l.at("position.X", x, y) + 1.5) / 3, 1e-5);
      }
    }
    EXPECT_GE(hit, 256) << name_of(integrator);
    EXPECT_LT(partly, hit);
  }
}

// pbrt's default: (0, 0), (1, 0), (1, 1) of a triangle; of a sphere the azimuth and the height.
TEST(SurfaceAovs, TextureCoordinatesOfWhatHasNone) {
  TestScene s;
  s.triangle({-9, -9, 3}, {-9, 9, 3}, {9, 9, 3}, s.diffuse(0.5f));
  s.triangle({-9, -9, 3}, {9, 9, 3}, {9, -9, 3}, s.diffuse(0.5f));
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(8, 8);
  const SurfaceLayers l(s.scene, settings_for(s.scene, Integrator::kPt, 16, 2), kAovUv | kAovPosition);
  int checked = 0;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const float px = l.at("position.X", x, y), py = l.at("position.Y", x, y);
      if (py - px < 0.8f) continue;  // not of the first triangle alone
      ASSERT_NEAR(l.at("uv.U", x, y), (py + 9) / 18, 1e-5);
      ASSERT_NEAR(l.at("uv.V", x, y), (px + 9) / 18, 1e-5);
      ++checked;
    }
  }
  EXPECT_GE(checked, 16);
}

/// Two quads that meet in the middle of the film, below half of it: one has its object's number, one its
/// material's.
TestScene numbered_quads() {
  TestScene s;
  s.quad({-9, -9, 3}, {0, 9, 0}, {9, 0, 0}, s.diffuse(0.5f));
  s.scene.shapes.back().names = {.object = s.scene.names.number("given"), .object_id = 70000};
  s.quad({0, -9, 3}, {0, 9, 0}, {9, 0, 0}, s.diffuse(0.25f));
  s.scene.shapes.back().names = {
      .object = s.scene.names.number("second"), .material = s.scene.names.number("chalk"), .material_id = 0};
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(16, 16);
  return s;
}

TEST(SurfaceAovs, NumbersOfObjectsAndMaterials) {
  const TestScene s = numbered_quads();
  const SurfaceLayers l(s.scene, settings_for(s.scene, Integrator::kPt, 8, 2), kAovsOfIds | kAovPosition);
  const bool right = l.at("position.X", 15, 15) > 0;
  const int given = right ? 0 : 15, second = right ? 15 : 0;
  EXPECT_EQ(l.at("objectid.V", given, 15), 70000);
  EXPECT_EQ(l.at("materialid.V", given, 15), 1);
  EXPECT_EQ(l.at("objectid.V", second, 15), 2);
  EXPECT_EQ(l.at("materialid.V", second, 15), 0);  // that is what the file says
  EXPECT_EQ(l.at("objectid.V", second, 0), 0);     // nothing
}

// Each place by its own name, be it copied into the world or not; those without have their object's.
TEST(SurfaceAovs, NumbersOfInstances) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  ObjectDescription& object = s.scene.objects.emplace_back();
  ShapeDescription& shape = object.shapes.emplace_back();
  shape.kind = SphereShape{0.4f};
  shape.material = grey;
  shape.names.object = s.scene.names.number("ball");
  for (int i = 0; i < 4; ++i) {
    InstanceDescription& instance = s.scene.instances.emplace_back();
    instance.object = 0;
    instance.object_to_world = translation({i - 1.5, 0, 2});
    if (i == 1) instance.names = {.object = s.scene.names.number("own")};
    if (i == 2) instance.names = {.object = s.scene.names.number("given"), .object_id = 9};
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(64, 64);
  const SurfaceLayers l(s.scene, settings_for(s.scene, Integrator::kPt, 4, 2), kAovsOfIds | kAovPosition);
  std::array<float, 4> ids{};
  for (int x = 0; x < 64; ++x) {
    const float id = l.at("objectid.V", x, 32), at = l.at("position.X", x, 32);
    if (id != 0) ids[static_cast<size_t>(std::lround(at + 1.5f))] = id;
  }
  EXPECT_EQ(ids, (std::array<float, 4>{1, 2, 9, 1}));
}

/// Of what is seen straight ahead, first as diffuse and then as specular albedo: red.
std::array<float, 2> split_albedo(const TestScene& s) {
  TestScene seen = s;
  seen.environment({1, 1, 1}).camera({0, 0, 0}, {0, 0, 1}, 2).film(8, 8);
  const SurfaceLayers l(seen.scene, settings_for(seen.scene, Integrator::kPt, 16, 3),
                        kAovAlbedo | kAovDiffuseAlbedo | kAovSpecularAlbedo);
  for (const std::string channel : {".R", ".G", ".B"}) {
    EXPECT_NEAR(l.at("diffusealbedo" + channel, 4, 4) + l.at("specularalbedo" + channel, 4, 4),
                l.at("albedo" + channel, 4, 4), 1e-6);
  }
  return {l.at("diffusealbedo.R", 4, 4), l.at("specularalbedo.R", 4, 4)};
}
TestScene wall_of(TestScene s, int material) {
  s.quad({-9, -9, 3}, {0, 18, 0}, {18, 0, 0}, material);
  return s;
}

TEST(SurfaceAovs, AlbedoOfOneKindOfLobes) {
  TestScene s;
  auto split = split_albedo(wall_of(s, s.diffuse(0.5f)));
  EXPECT_NEAR(split[0], 0.5, 1e-6);
  EXPECT_EQ(split[1], 0);
  split = split_albedo(wall_of(s, s.diffuse_transmission({0.25f, 0.25f, 0.25f}, {0.5f, 0.5f, 0.5f})));
  EXPECT_NEAR(split[0], 0.75, 0.05);
  EXPECT_EQ(split[1], 0);
  split = split_albedo(wall_of(s, s.conductor(0.5f, 0.2f)));
  EXPECT_EQ(split[0], 0);
  EXPECT_LE(split[1], 0.5);
  EXPECT_NEAR(split[1], 0.5, 0.05);  // single scattering loses what bounces between facets
  split = split_albedo(wall_of(s, s.dielectric(1.5f, 0.2f)));
  EXPECT_EQ(split[0], 0);
  EXPECT_NEAR(split[1], 1, 0.05);
}

// A coat of index 2 reflects (1 / 3)^2 straight back; the base gets the rest, twice.
TEST(SurfaceAovs, AlbedoOfACoatAndItsBase) {
  TestScene s;
  for (const float alpha : {0.0f, 0.1f}) {
    const auto black = split_albedo(wall_of(s, s.coated({0, 0, 0}, 2, alpha)));
    EXPECT_EQ(black[0], 0);
    EXPECT_NEAR(black[1], 1.0 / 9, 0.02) << alpha;
    const auto grey = split_albedo(wall_of(s, s.coated({0.5f, 0.5f, 0.5f}, 2, alpha)));
    EXPECT_NEAR(grey[1], 1.0 / 9, 0.03) << alpha;
    EXPECT_GT(grey[0], 0.1);
    EXPECT_LT(grey[0], 0.5);
  }
}

// Parts of a mix by their shares; and behind a mirror what it shows, tinted by it.
TEST(SurfaceAovs, AlbedoOfAMixAndOfAMirrorImage) {
  TestScene s;
  const int diffuse = s.diffuse(0.5f), metal = s.conductor(0.8f, 0.2f);
  const auto mixed = split_albedo(wall_of(s, s.mix(diffuse, metal, 0.25f)));
  EXPECT_NEAR(mixed[0], 0.75 * 0.5, 0.12);  // 16 samples choose
  EXPECT_NEAR(mixed[1], 0.25 * 0.8, 0.2);
  const int mirror = s.conductor(0.5f, 0);
  TestScene room = wall_of(s, mirror);
  room.quad({-9, -9, -3}, {18, 0, 0}, {0, 18, 0}, diffuse);
  const auto shown = split_albedo(room);
  EXPECT_NEAR(shown[0], 0.25, 1e-3);
  EXPECT_EQ(shown[1], 0);
}

// Threads, tiles and the order of packets; the film's snapshot; and adaptive sampling's weights.
TEST(SurfaceAovs, NobodyCanTellWhoRenderedWhat) {
  const SceneDescription scene = cornell_room().film(70, 40).scene;
  constexpr Aovs kAsked = kAovUv | kAovsOfIds | kAovDiffuseAlbedo | kAovSpecularAlbedo;
  for (const bool weighted : {false, true}) {
    RenderSettings settings = settings_for(scene, Integrator::kPt, 20, 3);
    settings.aovs = kAsked;
    if (weighted) {
      settings.plan = plan_of(settings);
      const RegionGrid regions = regions_of(settings.grid);
      settings.plan->allocation.levels = std::string(static_cast<size_t>(regions.count()), '0');
      for (int64_t i = 0; i < regions.count(); ++i)
        settings.plan->allocation.set_level(i, kLeastLevel + static_cast<int>(i * 7 % 5));
    }
    const Partial whole = render_partial(scene, settings);
    EXPECT_EQ(partial_digest(whole),
              partial_digest(render_partial(scene, settings, 3, PacketOrder::kScattered)));
    EXPECT_EQ(decode_partial(encode_partial(whole)), whole);
    const Renderer renderer(scene, settings, 1);
    Film film(settings.grid), parts(settings.grid);
    film.fold(whole);
    for (const auto& [begin, end] : {std::pair{16, 20}, {5, 16}, {0, 5}}) {
      parts.fold(decode_partial(encode_partial(render_samples(renderer, begin, end))));
      parts = Film::restore(parts.snapshot());
    }
    EXPECT_EQ(film.resolve_aovs().channels, aov_channels(kAsked, {}));
    EXPECT_EQ(film.resolve_aovs().image.data, parts.resolve_aovs().image.data);
  }
}

}  // namespace
}  // namespace lightmill::test
