#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/scene/description.h"
#include "common/scene/resolve_settings.h"

namespace lightmill {
namespace {

SceneDescription scene() {
  SceneDescription s;
  s.film.width = 300;
  s.film.height = 200;
  s.sampling = {"path", 64, 7, 3};
  return s;
}

ErrorKind kind_of(const SceneDescription& s, const RenderOptions& o) {
  try {
    resolve_settings(s, o);
  } catch (const Error& e) {
    return e.kind();
  }
  ADD_FAILURE() << "no error";
  return ErrorKind::kFailed;
}

TEST(Settings, TheSceneHoldsUnlessOverridden) {
  const RenderSettings s = resolve_settings(scene(), {});
  EXPECT_EQ(s.integrator, Integrator::kAuto);
  EXPECT_TRUE(needs_pilot(s));
  EXPECT_EQ(sampling_text(s), "auto");
  EXPECT_EQ(s.grid.width, 300);
  EXPECT_EQ(s.grid.crop, (PixelRect{0, 0, 300, 200}));
  EXPECT_EQ(s.spp, 64);
  EXPECT_EQ(s.max_depth, 7);
  EXPECT_EQ(s.seed, 3u);

  RenderOptions o;
  o.integrator = "scene";
  o.spp = 5;
  o.max_depth = kUnlimitedDepth;
  o.seed = 9;
  o.width = 30;
  o.height = 20;
  o.time_s = 2.5;
  const RenderSettings t = resolve_settings(scene(), o);
  EXPECT_EQ(t.integrator, Integrator::kPt);
  EXPECT_EQ(t.spp, 5);
  EXPECT_EQ(t.max_depth, kUnlimitedDepth);
  EXPECT_EQ(t.seed, 9u);
  EXPECT_EQ(t.grid.width, 30);
  EXPECT_EQ(t.time_s, 2.5);
}

TEST(Settings, StrategiesThatTheSceneDoesNotAllowAreLeftOut) {
  SceneDescription s = scene();
  RenderOptions o;
  o.integrator = "bdpt";
  EXPECT_FALSE(resolve_settings(s, o).plan) << "all are possible";
  s.camera.kind = CameraKind::kRealistic;
  EXPECT_EQ(strategies_of(resolve_settings(s, o)), kAllStrategies & ~kLightTracing);
  EXPECT_FALSE(resolve_settings(s, {}).plan) << "the pilot sees to it";
  s.materials.emplace_back().kind = HairMaterial();
  EXPECT_EQ(strategies_of(resolve_settings(s, o)), kAllStrategies & ~kLightTracing) << "nothing is of hair";
  s.shapes.emplace_back().kind = SphereShape();
  s.shapes.back().material = 0;
  EXPECT_EQ(strategies_of(resolve_settings(s, o)), kEmissionHits | kNextEvent);
  o.integrator = "pt";
  EXPECT_FALSE(resolve_settings(s, o).plan) << "pt has no other";
  o.strategies = "hit,light-tracing";
  EXPECT_EQ(kind_of(s, o), ErrorKind::kUsage);
  o.strategies.reset();
  o.overrides = "vertex-connection";
  EXPECT_EQ(kind_of(s, o), ErrorKind::kUsage);
  o.overrides.reset();
  o.integrator = "lt";
  EXPECT_EQ(kind_of(s, o), ErrorKind::kUsage);
  s.sampling.integrator = "lightpath";
  o.integrator = "scene";
  EXPECT_EQ(kind_of(s, o), ErrorKind::kBadScene);
}

TEST(Settings, CropKeepsItsFractions) {
  SceneDescription s = scene();
  s.film.crop = {0, 0.5, 0.25, 1};
  EXPECT_EQ(resolve_settings(s, {}).grid.crop, (PixelRect{0, 50, 150, 200}));
  RenderOptions o;
  o.width = 30;
  o.height = 20;
  EXPECT_EQ(resolve_settings(s, o).grid.crop, (PixelRect{0, 5, 15, 20}));
  o.crop = {{0.5, 1, 0, 0.5}};
  EXPECT_EQ(resolve_settings(s, o).grid.crop, (PixelRect{15, 0, 30, 10}));
}

TEST(Settings, ExtremeSidesAreFine) {
  RenderOptions o;
  o.width = o.height = 1;
  EXPECT_EQ(resolve_settings(scene(), o).grid.crop.area(), 1);
  o.height = 20000;
  EXPECT_EQ(resolve_settings(scene(), o).grid.height, 20000);
}

TEST(Settings, OptionsOutOfRangeAreUsageErrors) {
  const auto refuse = [](auto change) {
    RenderOptions o;
    change(o);
    EXPECT_EQ(kind_of(scene(), o), ErrorKind::kUsage);
  };
  refuse([](RenderOptions& o) { o.integrator = "path"; });
  refuse([](RenderOptions& o) { o.spp = -1; });
  refuse([](RenderOptions& o) { o.spp = 0; });
  refuse([](RenderOptions& o) { o.spp = (int64_t{1} << 31) + 1; });
  refuse([](RenderOptions& o) { o.max_depth = -1; });
  refuse([](RenderOptions& o) { o.max_depth = kUnlimitedDepth + 1; });
  refuse([](RenderOptions& o) { o.width = 0; });
  refuse([](RenderOptions& o) { o.width = o.height = 100000; });
  refuse([](RenderOptions& o) { o.width = o.height = 65536; });
  refuse([](RenderOptions& o) { o.time_s = 0; });
  refuse([](RenderOptions& o) { o.time_s = NAN; });
  refuse([](RenderOptions& o) { o.target_error = -1; });
  refuse([](RenderOptions& o) { o.crop = {{0.5, 0.5, 0, 1}}; });
  refuse([](RenderOptions& o) { o.crop = {{0, 1.5, 0, 1}}; });
  refuse([](RenderOptions& o) { o.crop = {{0, NAN, 0, 1}}; });
  refuse([](RenderOptions& o) { o.crop = {{0.101, 0.102, 0, 1}}; });
}

TEST(Settings, ASceneOutOfRangeIsABadScene) {
  SceneDescription s = scene();
  s.film.width = 0;
  EXPECT_EQ(kind_of(s, {}), ErrorKind::kBadScene);
  s = scene();
  s.sampling.spp = 0;
  EXPECT_EQ(kind_of(s, {}), ErrorKind::kBadScene);
}

TEST(Settings, APlanIsPartOfThem) {
  RenderOptions o;
  o.plan = SamplingPlan{kEmissionHits | kNextEvent | kLightTracing, 0.5, 1};
  const RenderSettings s = resolve_settings(scene(), o);
  EXPECT_FALSE(needs_pilot(s));
  EXPECT_EQ(settings_from_json(settings_to_json(s)).plan, o.plan);
  EXPECT_EQ(sampling_text(s), "auto: hit,next-event,light-tracing × 0.5");
  o.plan->connections = 3;
  EXPECT_EQ(kind_of(scene(), o), ErrorKind::kUsage);
}

TEST(Settings, JsonRoundTrip) {
  RenderOptions o;
  o.integrator = "lt";
  o.seed = ~uint64_t{0};
  o.spp = int64_t{1} << 31;
  o.crop = {{0.1, 0.9, 0.3, 0.7}};
  o.target_error = 0.1 + 0.2;
  const RenderSettings s = resolve_settings(scene(), o);
  const std::string json = settings_to_json(s);
  const RenderSettings t = settings_from_json(json);
  EXPECT_EQ(settings_to_json(t), json);
  EXPECT_EQ(t.grid, s.grid);
  EXPECT_EQ(t.seed, s.seed);
  EXPECT_EQ(t.spp, s.spp);
  EXPECT_EQ(t.integrator, Integrator::kLt);
  EXPECT_EQ(t.target_error, s.target_error);
}

TEST(Settings, MalformedJsonIsRefused) {
  const std::string good = settings_to_json(resolve_settings(scene(), {}));
  const std::pair<const char*, const char*> changes[] = {
      {"\"spp\":64", "\"spp\":0"},
      {"\"spp\":64", "\"spp\":-5"},
      {"\"spp\":64", "\"spp\":1.5"},
      {"\"spp\":64", "\"spp\":1e30"},
      {"\"spp\":64", "\"spp\":\"64\""},
      {"\"width\":300", "\"width\":100000"},
      {"\"width\":300", "\"width\":10"},
      {"\"seed\":3", "\"seed\":-3"},
      {"auto", "mlt"},
      {"[0,0,300,200]", "[0,0,300]"},
      {"[0,0,300,200]", "[5,0,5,200]"},
      {"\"max_depth\":7", "\"max_depth\":-1"},
      {"\"max_depth\":7", "\"other\":7"},
      {"{", "["},
      {"\"time_s\":0.0", "\"time_s\":-1.0"},
      {"\"spp\":64", "\"spp\":18446744073709551615"},
  };
  for (const auto& [from, to] : changes) {
    std::string text = good;
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, std::string(from).size(), to);
    EXPECT_THROW(settings_from_json(text), Error) << text;
  }
  EXPECT_THROW(settings_from_json(""), Error);
  EXPECT_THROW(settings_from_json(std::string(100000, '[')), Error);
}

}  // namespace
}  // namespace lightmill
