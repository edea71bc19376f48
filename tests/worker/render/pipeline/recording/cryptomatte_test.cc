// Cryptomatte: who is where in scenes whose coverage is known, and that nobody can tell who rendered what.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/film/film.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"
#include "common/job/sample_allocation.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr Aovs kAsked = kAovsOfCryptomatte | kAovAlpha;

/// Names the last shape.
void name_last(TestScene* s, const std::string& object, const std::string& asset = "set") {
  s->scene.shapes.back().names = {s->scene.names.number(object), s->scene.names.number(asset)};
}

RenderSettings settings_of(const SceneDescription& scene, int64_t spp,
                           Integrator integrator = Integrator::kPt) {
  RenderSettings settings = settings_for(scene, integrator, spp, 3);
  settings.aovs = kAsked;
  return settings;
}

/// A film's mattes.
class Mattes {
 public:
  explicit Mattes(const Film& film) : aovs_(film.resolve_aovs()) {
    for (size_t c = 0; c < aovs_.channels.size(); ++c) at_[aovs_.channels[c]] = c;
  }
  Mattes(const SceneDescription& scene, const RenderSettings& settings)
      : Mattes([&] {
          Film film(settings.grid);
          film.fold(render_partial(scene, settings));
          return film;
        }()) {}
  float value(const std::string& channel, int x, int y) const {
    return aovs_.image.pixel(x, y)[at_.at(channel)];
  }
  /// What a name covers of a pixel.
  float coverage(const std::string& layer, const std::string& name, int x, int y) const {
    float sum = 0;
    for_each_rank(layer, x, y, [&](float id, float coverage) {
      if (std::bit_cast<uint32_t>(id) == cryptomatte_bits(name)) sum += coverage;
    });
    return sum;
  }
  float sum(const std::string& layer, int x, int y) const {
    float sum = 0;
    for_each_rank(layer, x, y, [&](float, float coverage) { sum += coverage; });
    return sum;
  }
  nlohmann::json manifest(const std::string& layer) const {
    return nlohmann::json::parse(aovs_.attributes.at(cryptomatte_prefix(layer) + "manifest"));
  }
  const ChannelImage& aovs() const { return aovs_; }

 private:
  template <class F>
  void for_each_rank(const std::string& layer, int x, int y, const F& f) const {
    for (int i = 0; i < kMatteRanks / 2; ++i) {
      const std::string name = layer + "0" + std::to_string(i);
      f(value(name + ".r", x, y), value(name + ".g", x, y));
      f(value(name + ".b", x, y), value(name + ".a", x, y));
    }
  }

  ChannelImage aovs_;
  std::map<std::string, size_t> at_;
};

void expect_sums_of_alpha(const Mattes& m, const FilmGrid& grid) {
  for (int y = 0; y < grid.crop.height(); ++y) {
    for (int x = 0; x < grid.crop.width(); ++x) {
      for (const char* layer : {"CryptoObject", "CryptoMaterial", "CryptoAsset"})
        ASSERT_NEAR(m.sum(layer, x, y), m.value("A", x, y), 1e-6) << layer << ' ' << x << ' ' << y;
    }
  }
}

/// Two quads in the plane z = 3 that meet in the middle of a column of pixels; above them is nothing.
TestScene halves(int width) {
  TestScene s;
  const double pixel = 6.0 / width;
  const int left = s.diffuse(0.5f), right = s.diffuse(0.25f);
  s.scene.materials[static_cast<size_t>(left)].name = "chalk";
  s.scene.materials[static_cast<size_t>(right)].name = "slate";
  s.quad({-9, -9, 3}, {0, 9, 0}, {9 + pixel / 2, 0, 0}, left);
  name_last(&s, "left");
  s.quad({pixel / 2, -9, 3}, {0, 9, 0}, {9, 0, 0}, right);
  name_last(&s, "right", "other set");
  s.environment({1, 1, 1});
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(width, width);
  return s;
}

TEST(Cryptomatte, PixelsThatAreHalfCovered) {
  constexpr int kWidth = 16;
  const TestScene s = halves(kWidth);
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const RenderSettings settings = settings_of(s.scene, 64, integrator);
    const Mattes m(s.scene, settings);
    const int y = kWidth - 2;
    // The camera may look to either hand.
    int column = kWidth / 2;
    if (m.coverage("CryptoObject", "left", 0, y) < 0.5f) column = kWidth / 2 - 1;
    const int inner = column == kWidth / 2 ? 0 : kWidth - 1;
    EXPECT_EQ(m.coverage("CryptoObject", "left", inner, y), 1) << name_of(integrator);
    EXPECT_EQ(m.value("CryptoObject00.r", inner, y), cryptomatte_id("left"));
    for (const auto& [layer, one, other] : {std::array{"CryptoObject", "left", "right"},
                                            {"CryptoMaterial", "chalk", "slate"},
                                            {"CryptoAsset", "set", "other set"}}) {
      EXPECT_NEAR(m.coverage(layer, one, column, y), 0.5, 0.05) << layer;
      EXPECT_NEAR(m.coverage(layer, other, column, y), 0.5, 0.05) << layer;
    }
    EXPECT_EQ(m.value("CryptoObject00.g", inner, 0), 0);  // the sky
    expect_sums_of_alpha(m, settings.grid);
    EXPECT_EQ(m.manifest("CryptoObject"),
              nlohmann::json({{"left", cryptomatte_hex("left")}, {"right", cryptomatte_hex("right")}}));
    EXPECT_EQ(m.manifest("CryptoMaterial").size(), 2u);
  }
}

/// A mesh of a square in the plane z = 0, of more triangles than what is copied into the world has.
std::shared_ptr<const TriangleMesh> square(int side) {
  auto mesh = std::make_shared<TriangleMesh>();
  for (int y = 0; y <= side; ++y) {
    for (int x = 0; x <= side; ++x) {
      mesh->positions.push_back({static_cast<float>(x) / static_cast<float>(side) - 0.5f,
                                 static_cast<float>(y) / static_cast<float>(side) - 0.5f, 0});
    }
  }
  const auto at = [&](int x, int y) { return static_cast<uint32_t>(y * (side + 1) + x); };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      mesh->triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh->triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  return mesh;
}

// Each instance by its own name, whether it is copied into the world or not; and one that has none by that of
// its object's shapes.
TEST(Cryptomatte, AGridOfInstances) {
  constexpr int kSide = 4;
  for (const int mesh_side : {2, 12}) {
    TestScene s;
    const int material = s.diffuse(0.5f);
    ObjectDescription& object = s.scene.objects.emplace_back();
    ShapeDescription& shape = object.shapes.emplace_back();
    shape.kind = MeshShape{square(mesh_side)};
    shape.material = material;
    shape.names = {s.scene.names.number("tile"), s.scene.names.number("tiles")};
    for (int i = 0; i < kSide * kSide; ++i) {
      InstanceDescription& instance = s.scene.instances.emplace_back();
      instance.object = 0;
      instance.object_to_world = translation({i % kSide - 1.5, i / kSide - 1.5, 2});
      if (i > 0) instance.names.object = s.scene.names.number("tile " + std::to_string(i));
    }
    s.environment({1, 1, 1});
    s.camera({0, 0, 0}, {0, 0, 1}, 90).film(64, 64);
    const RenderSettings settings = settings_of(s.scene, 4);
    const Mattes m(s.scene, settings);
    const auto objects = m.manifest("CryptoObject");
    ASSERT_EQ(objects.size(), static_cast<size_t>(kSide * kSide));
    ASSERT_EQ(m.manifest("CryptoAsset").size(), 1u);
    std::map<std::string, double> covered;
    for (const auto& [name, id] : objects.items()) {
      for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) covered[name] += m.coverage("CryptoObject", name, x, y);
      }
    }
    // Each covers a sixteenth of the picture.
    for (const auto& [name, pixels] : covered) EXPECT_NEAR(pixels, 16 * 16, 1) << name << ' ' << mesh_side;
    EXPECT_TRUE(covered.contains("tile"));
    EXPECT_TRUE(covered.contains("tile 15"));
    expect_sums_of_alpha(m, settings.grid);
  }
}

TEST(Cryptomatte, SpheresAndHoldouts) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.sphere({0, 0, 3}, 1, grey);
  name_last(&s, "ball");
  s.sphere({2, 0, 3}, 0.5, grey);
  name_last(&s, "small");
  ClosureMaterial holdout;
  holdout.closure = ClosureKind::kHoldout;
  s.scene.materials.emplace_back().kind = holdout;
  s.quad({-9, -9, 2}, {0, 9, 0}, {18, 0, 0}, static_cast<int>(s.scene.materials.size()) - 1);
  name_last(&s, "held out");
  s.environment({1, 1, 1});
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(32, 32);
  const RenderSettings settings = settings_of(s.scene, 8);
  const Mattes m(s.scene, settings);
  EXPECT_EQ(m.coverage("CryptoObject", "ball", 16, 14), 1);
  EXPECT_EQ(m.sum("CryptoObject", 16, 30), 0);
  EXPECT_EQ(m.manifest("CryptoObject").size(), 2u);
  expect_sums_of_alpha(m, settings.grid);
}

// Whatever it meets afterwards.
TEST(Cryptomatte, WhatScattersInAMediumCountsForNothing) {
  constexpr int kWidth = 16;
  TestScene s = halves(kWidth);
  s.scene.media.push_back({"", {0, 0, 0}, {0.5f, 0.5f, 0.5f}, {}, 0, {}});
  s.scene.camera.medium = 0;
  const RenderSettings settings = settings_of(s.scene, 256);
  const Mattes m(s.scene, settings);
  const double clear = std::exp(-0.5 * 3 * 1.01);  // the pixels beside the axis are a little further away
  for (const int x : {kWidth / 2 - 1, kWidth / 2}) {
    EXPECT_NEAR(m.value("A", x, kWidth / 2), clear, 0.08);
    EXPECT_NEAR(m.sum("CryptoObject", x, kWidth / 2), clear, 0.08);
  }
  expect_sums_of_alpha(m, settings.grid);
}

TEST(Cryptomatte, NobodyCanTellWhoRenderedWhat) {
  const SceneDescription scene = halves(70).scene;
  const RenderSettings settings = settings_of(scene, 20);
  const Partial whole = render_partial(scene, settings);
  const Partial scattered = render_partial(scene, settings, 3, PacketOrder::kScattered);
  EXPECT_EQ(whole.mattes, scattered.mattes);
  EXPECT_EQ(partial_digest(whole), partial_digest(scattered));
  EXPECT_EQ(decode_partial(encode_partial(whole)), whole);
  const Renderer renderer(scene, settings, 1);
  Film film(settings.grid), parts(settings.grid);
  film.fold(whole);
  for (const auto& [begin, end] : {std::pair{16, 20}, {5, 16}, {0, 5}}) {
    parts.fold(decode_partial(encode_partial(render_samples(renderer, begin, end))));
    parts = Film::restore(parts.snapshot());
  }
  const ChannelImage one = film.resolve_aovs(), other = parts.resolve_aovs();
  EXPECT_EQ(one.attributes, other.attributes);
  ASSERT_EQ(one.image.data.size(), other.image.data.size());
  for (size_t i = 0; i < one.image.data.size(); ++i) ASSERT_EQ(one.image.data[i], other.image.data[i]);
}

TEST(Cryptomatte, TheColourKeepsItsBits) {
  const SceneDescription scene = halves(40).scene;
  RenderSettings settings = settings_of(scene, 6, Integrator::kBdpt);
  Film with(settings.grid), without(settings.grid);
  with.fold(render_partial(scene, settings));
  settings.aovs = 0;
  without.fold(render_partial(scene, settings));
  EXPECT_EQ(with.resolve().data, without.resolve().data);
}

// Coverage is a mean over weights where samples have some.
TEST(Cryptomatte, OfAllocatedSamplesSaysTheSame) {
  const SceneDescription scene = halves(70).scene;
  RenderSettings settings = settings_of(scene, 64);
  const Mattes uniform(scene, settings);
  settings.plan = plan_of(settings);
  const RegionGrid regions = regions_of(settings.grid);
  settings.plan->allocation.levels = std::string(static_cast<size_t>(regions.count()), '0');
  for (int64_t i = 0; i < regions.count(); ++i)
    settings.plan->allocation.set_level(i, kLeastLevel + static_cast<int>(i * 7 % 5));
  ASSERT_TRUE(Renderer(scene, settings, 1).aovs().weighted);
  const Mattes adapted(scene, settings);
  expect_sums_of_alpha(adapted, settings.grid);
  for (int y = 0; y < 70; ++y) {
    for (int x = 0; x < 70; ++x) {
      for (const char* name : {"left", "right"})
        ASSERT_NEAR(adapted.coverage("CryptoObject", name, x, y),
                    uniform.coverage("CryptoObject", name, x, y), 0.15);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
