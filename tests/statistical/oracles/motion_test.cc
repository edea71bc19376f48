// Motion blur: the image is the mean over the exposure of images that stand still, to every estimator. A
// camera that passes an edge blurs it by its way's box. alpha = 1e-4 over the blocks of an image.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/instanced_scene.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/volumes.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16, kStrata = 16;

Batches render(const SceneDescription& s, const RenderSettings& settings) {
  Batches b = render_batches(s, settings, kBatches);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}
RenderSettings settings_of(const SceneDescription& s, Integrator integrator, int64_t spp = 4096) {
  return settings_for(s, integrator, spp, 4);
}

/// Batches of means over stills, one at a random time of each of kStrata parts of the exposure.
Batches mean_of_stills(const SceneDescription& scene, RenderSettings settings) {
  settings.spp /= kBatches * kStrata;
  Random random(settings.seed + 77);
  Batches result;
  for (int b = 0; b < kBatches; ++b) {
    for (int k = 0; k < kStrata; ++k) {
      settings.seed = static_cast<uint64_t>(1000 + b * kStrata + k);
      const double time = (k + double{random.uniform()}) / kStrata;
      const Image still = render_batches(still_at(scene, time), settings, 1).images[0];
      if (k == 0) {
        result.images.push_back(still);
      } else {
        for (size_t i = 0; i < still.data.size(); ++i) result.images.back().data[i] += still.data[i];
      }
    }
    for (float& x : result.images.back().data) x /= kStrata;
  }
  return result;
}

/// A room with a ball that passes, a masked leaf that turns, a masked one that bends, an instance that flies
/// with a part that turns about it, and a camera that moves and turns.
TestScene moving_room() {
  TestScene s = cornell_room();
  s.film(24, 24);
  s.scene.textures.push_back(
      {"holes", false, CheckerboardTexture{{{1, 1, 1}, -1}, {{0, 0, 0}, -1}, {6, 6, 0, 0}}, {}});
  const int shiny = s.conductor(0.9f, 0.3f), blue = s.diffuse(Rgb{0.2f, 0.3f, 0.8f});
  const auto moving = [&](ShapeKind kind, int material, const Transform& start, const Transform& end) {
    ShapeDescription& d = s.scene.shapes.emplace_back();
    d.kind = std::move(kind);
    d.material = material;
    d.object_to_world = start;
    d.moves_to = ends_at(&s, end);
    return &d;
  };
  const MeshShape ball{ball_mesh(1, 32)};
  moving(SphereShape{0.25f}, shiny, translation({-0.6, -0.7, 0.3}), translation({0.5, -0.7, 0.1}));
  const Transform leaf = translation({-0.4, 0.3, 0.5}) * scaling({0.35, 0.5, 0.05});
  moving(ball, blue, leaf, leaf * rotation(150, {0, 0, 1}))->alpha.texture =
      static_cast<int>(s.scene.textures.size()) - 1;
  ShapeDescription& sail = s.scene.shapes.emplace_back();
  sail.kind = MeshShape{bending(*ball.mesh, 4, [](const Vec3f& p, double time) {
    const auto by = static_cast<float>(time * (1.5 - time));
    return Vec3f{p.x + by * p.y * p.y, p.y * (1 + 0.5f * by), p.z + 2 * by * p.x};
  })};
  sail.material = shiny;
  sail.object_to_world = translation({0.1, -0.2, 0.6}) * scaling({0.2, 0.4, 0.1});
  sail.alpha.texture = static_cast<int>(s.scene.textures.size()) - 1;
  const int o = begin_object(&s, "o");
  add_to_object(&s, o, ball, blue, scaling({0.15, 0.1, 0.1}));
  const Transform part = translation({0.25, 0, 0}) * scaling({0.08, 0.08, 0.08});
  add_to_object(&s, o, ball, shiny, part).moves_to = ends_at(&s, rotation(120, {0, 1, 0}) * part);
  instance(&s, o, translation({0.5, 0.6, 0.4}));
  s.scene.instances.back().moves_to = ends_at(&s, translation({0.3, -0.1, 0.2}) * rotation(90, {1, 1, 0}));
  s.scene.camera.moves_to =
      ends_at(&s, translation({0.1, 0.05, 0}) * s.scene.camera.camera_to_world * rotation(6, {0.2, 1, 0.1}));
  return s;
}

TEST(MotionBlur, IsTheMeanOfStillsToEveryEstimator) {
  const SceneDescription room = moving_room().scene;
  ASSERT_EQ(build_scene(room).ways.size(), 5u);
  ASSERT_TRUE(build_scene(room).any_bending());
  ASSERT_TRUE(build_scene(room).camera_motion.moves);
  const RenderSettings pt = settings_of(room, Integrator::kPt), bdpt = settings_of(room, Integrator::kBdpt),
                       lt = settings_of(room, Integrator::kLt, 8192);
  const Batches by_pt = render(room, pt), by_bdpt = render(room, bdpt), by_lt = render(room, lt);
  const Batches stills = mean_of_stills(room, pt);
  EXPECT_TRUE(images_agree(by_pt, stills));
  EXPECT_TRUE(images_agree(by_bdpt, stills));
  EXPECT_TRUE(images_agree(by_bdpt, mean_of_stills(room, bdpt)));
  EXPECT_TRUE(images_agree(by_pt, by_bdpt));
  EXPECT_TRUE(images_agree(by_lt, stills, {.max_excluded = 0.4}));
  // Where every subpath has a time of its own.
  RenderSettings apart = bdpt;
  apart.plan = SamplingPlan{.strategies = kEmissionHits | kNextEvent | kLightTracing};
  EXPECT_TRUE(images_agree(render(room, apart), stills));
  // It can fail.
  EXPECT_FALSE(images_agree(by_pt, scaled(stills, 1.03f)));
  EXPECT_FALSE(images_agree(by_pt, render(still_at(room, 0.5), pt)));
}

/// A room lit by a fire that rises, turns and grows within a ball of smoke that goes along, beside a cloud
/// that stands still.
TestScene room_of_moving_fire() {
  TestScene s;
  s.film(24, 24);
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.6f), {.inward = true});
  int voxel = 0;
  const auto random = [&](double, double, double) { return random_density(voxel++, 1, 2, 1); };
  auto fire = std::make_shared<MediumGrid>(*grid_of(field_of({17, 11, 13, {-1, -1, -1}, {1, 1, 1}}, random)));
  fire->emission = field_of({17, 11, 13, {-1, -1, -1}, {1, 1, 1}},
                            [](double x, double y, double) { return x > 0.3 ? 8 : 2 + y; });
  const Transform start = translation({-0.35, -0.35, 0.1}) * scaling({0.35, 0.35, 0.35}),
                  end = translation({0.3, 0.3, 0.2}) * rotation(110, {0.2, 1, 0.4}) *
                        scaling({0.45, 0.45, 0.45});
  fire->medium_to_world = start;
  fire->moves_to = ends_at(&s, end);
  const int burning = add_grid_medium(&s, {2, 3, 1}, {1, 1, 3}, fire, 0.3f, {4, 2, 1});
  const auto ball = [&](const Transform& at, double radius, int inside) -> ShapeDescription& {
    ShapeDescription& d = s.scene.shapes.emplace_back();
    d.kind = SphereShape{static_cast<float>(radius)};
    d.material = 0;
    d.object_to_world = at;
    d.media = {inside, -1};
    d.boundary = true;
    return d;
  };
  ball(start, 1, burning).moves_to = fire->moves_to;
  const int still = add_grid_medium(&s, {}, {2, 1, 3},
                                    grid_of(field_of({9, 9, 9, {0.2, -0.9, -0.6}, {0.8, -0.3, 0}}, random)));
  ball(translation({0.5, -0.6, -0.3}), 0.3, still);
  s.camera({0, 0.1, -0.95}, {0, 0, 1}, 80);
  return s;
}

TEST(MotionBlur, OfMediaIsTheMeanOfStills) {
  const SceneDescription room = room_of_moving_fire().scene;
  const RenderScene built = build_scene(room);
  ASSERT_TRUE(built.volumes.any_moving());
  ASSERT_TRUE(built.lights.any_moving());
  RenderSettings pt = settings_of(room, Integrator::kPt), bdpt = settings_of(room, Integrator::kBdpt);
  pt.max_depth = bdpt.max_depth = 5;
  const Batches by_pt = render(room, pt), by_bdpt = render(room, bdpt), stills = mean_of_stills(room, pt);
  EXPECT_TRUE(images_agree(by_pt, stills));
  EXPECT_TRUE(images_agree(by_bdpt, stills));
  RenderSettings by_lamps = pt, by_hits = pt;
  by_lamps.plan = SamplingPlan{.strategies = kEmissionHits | kNextEvent | kLightTracing};
  by_hits.plan = SamplingPlan{.strategies = kEmissionHits};
  EXPECT_TRUE(images_agree(render(room, by_lamps), stills));
  EXPECT_TRUE(images_agree(render(room, by_hits), stills));
  // It can fail.
  EXPECT_FALSE(images_agree(by_pt, scaled(stills, 1.03f)));
  EXPECT_FALSE(images_agree(by_pt, render(still_at(room, 0.5), pt)));
}

/// A room whose lamps move: one that passes and turns, one that bends, an instance, a spot light that swings
/// and a point light, and a ball that casts shadows.
TestScene room_of_moving_lamps() {
  TestScene s = cornell_room();
  s.film(24, 24);
  const int black = s.diffuse(0), grey = s.diffuse(0.6f);
  s.scene.shapes.pop_back();  // the lamp of the room
  s.scene.area_lights.clear();
  s.scene.area_lights.push_back({{9, 8, 6}});
  s.scene.area_lights.push_back({{2, 4, 7}, true});
  const auto lamp = [&](const std::shared_ptr<const TriangleMesh>& mesh, int light, const Transform& at) {
    ShapeDescription d;
    d.kind = MeshShape{mesh};
    d.material = black;
    d.area_light = light;
    d.object_to_world = at;
    return d;
  };
  const auto pane = std::make_shared<TriangleMesh>();
  pane->positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
  pane->triangles = {{0, 1, 2}, {0, 2, 3}};
  const Transform first = translation({-0.5, 0.8, 0}) * scaling({0.2, 0.2, 0.2});
  s.scene.shapes.push_back(lamp(pane, 0, first));
  s.scene.shapes.back().moves_to =
      ends_at(&s, translation({0.5, 0.7, 0.4}) * rotation(70, {1, 0, 0.3}) * scaling({0.3, 0.2, 0.1}));
  s.scene.shapes.push_back(lamp(bending(*pane, 4,
                                        [](const Vec3f& p, double time) {
                                          const auto by = static_cast<float>(time * (2 - time));
                                          return Vec3f{p.x * (1 + by), p.y + by * p.x, p.z - by};
                                        }),
                                1, translation({0.5, -0.3, 0.2}) * scaling({0.15, 0.15, 0.15})));
  const int o = begin_object(&s, "o");
  s.scene.objects.back().shapes.push_back(lamp(ball_mesh(0.1, 8), 1, translation({0.2, 0, 0})));
  instance(&s, o, translation({-0.7, -0.4, -0.2}));
  s.scene.instances.back().moves_to = ends_at(&s, translation({-0.4, 0.2, -0.2}) * rotation(120, {0, 1, 0}));
  LightDescription spot{SpotLight{{2, 1.5f, 1}, {0.3, 0.9, -0.5}, {0, -1, 0}, 20, 40}};
  spot.later = {SpotLight{{2, 1.5f, 1}, {0.3, 0.9, 0}, {0.6, -0.8, 0}, 20, 40},
                SpotLight{{2, 1.5f, 1}, {0.1, 0.6, 0.2}, {0, -0.8, 0.6}, 20, 40}};
  s.scene.lights.push_back(spot);
  LightDescription point{PointLight{{0.2f, 0.5f, 0.3f}, {-0.8, -0.8, -0.6}}};
  point.later = {PointLight{{0.2f, 0.5f, 0.3f}, {0.8, -0.6, -0.6}}};
  s.scene.lights.push_back(point);
  ShapeDescription& ball = s.scene.shapes.emplace_back();
  ball.kind = SphereShape{0.25f};
  ball.material = grey;
  ball.object_to_world = translation({0, -0.6, 0.2});
  return s;
}

TEST(MotionBlur, LampsThatMoveAreTheMeanOfStillsToEveryEstimator) {
  const SceneDescription room = room_of_moving_lamps().scene;
  const RenderScene built = build_scene(room);
  ASSERT_EQ(built.ways.size(), 3u);
  ASSERT_TRUE(built.lights.any_moving());
  const RenderSettings pt = settings_of(room, Integrator::kPt), bdpt = settings_of(room, Integrator::kBdpt),
                       lt = settings_of(room, Integrator::kLt, 8192);
  const Batches by_pt = render(room, pt), by_bdpt = render(room, bdpt);
  const Batches stills = mean_of_stills(room, pt);
  EXPECT_TRUE(images_agree(by_pt, stills));
  EXPECT_TRUE(images_agree(by_bdpt, stills));
  EXPECT_TRUE(images_agree(render(room, lt), stills, {.max_excluded = 0.4}));
  RenderSettings hits = pt;
  hits.plan = SamplingPlan{.strategies = kEmissionHits | kNextEvent | kLightTracing};
  EXPECT_TRUE(images_agree(render(room, hits), stills));
  // It can fail.
  EXPECT_FALSE(images_agree(by_pt, render(still_at(room, 0.5), pt)));
}

// Under a sky, where all that matters is what a turning blade hides when.
TEST(MotionBlur, ATurningBladeIsTheMeanOfStills) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.quad({-3, -1, 0}, {0, 0, 8}, {6, 0, 0}, grey).environment({1, 1.5f, 2});
  ShapeDescription& blade = s.scene.shapes.emplace_back();
  blade.kind = MeshShape{ball_mesh(1, 32)};
  blade.material = s.diffuse(0.8f);
  blade.object_to_world = translation({0, 0.3, 4}) * scaling({1.6, 0.2, 0.1});
  blade.moves_to =
      ends_at(&s, translation({0, 0.3, 4}) * rotation(175, {0.1, 0.1, 1}) * scaling({1.6, 0.2, 0.1}));
  s.camera({0, 0, 0}, {0, 0, 1}, 50).film(24, 24);
  const RenderSettings pt = settings_of(s.scene, Integrator::kPt);
  const Batches moving = render(s.scene, pt);
  EXPECT_TRUE(images_agree(moving, mean_of_stills(s.scene, pt)));
  SceneDescription slower = s.scene;
  slower.later[0] = translation({0, 0.3, 4}) * rotation(150, {0.1, 0.1, 1}) * scaling({1.6, 0.2, 0.1});
  EXPECT_FALSE(images_agree(moving, render(slower, pt)));
}

// Half a plane at z = 5 shines, x < 0. The camera goes from x = -1 to 1: where it looks along the slope t,
// the plane is bright for the part (1 - 5 t) / 2 of its way.
TEST(MotionBlur, ACameraThatPassesAnEdgeBlursItByABox) {
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    TestScene s;
    s.quad({-40, -20, 5}, {0, 40, 0}, {40, 0, 0}, s.diffuse(0), {.radiance = {1, 1, 1}});
    s.camera({-1, 0, 0}, {-1, 0, 5}, 60).film(32, 16);
    s.scene.camera.moves_to = ends_at(&s, translation({2, 0, 0}) * s.scene.camera.camera_to_world);
    const Batches b =
        render(s.scene, settings_for(s.scene, integrator, integrator == Integrator::kLt ? 131072 : 4096, 1));
    // A hundredth of the plane's radiance is told in dim columns, a tenth of theirs in others.
    const double half_width =
        std::tan(M_PI / 6) * 2;  // of the picture, as a slope: 60 degrees are the height
    for (int x = 0; x < 32; ++x) {
      double exact = 0;
      constexpr int kParts = 1000;
      for (int i = 0; i < kParts; ++i) {
        const double slope = ((x + (i + 0.5) / kParts) / 16 - 1) * half_width;
        exact += std::clamp((1 - 5 * slope) / 2, 0.0, 1.0) / kParts;
      }
      const Estimate e = b.mean({x, 0, x + 1, 16}, 0);
      SCOPED_TRACE(testing::Message() << name_of(integrator) << ", column " << x);
      if (exact < 1e-3) {
        EXPECT_NEAR(e.mean, exact, 1e-3);
      } else {
        EXPECT_TRUE(mean_is(
            e, exact, {.alpha = 1e-4 / 96, .resolution = std::max(0.1, 0.01 / exact), .rounding = 2e-4}));
      }
    }
  }
}

// A black bar, 2 wide, goes from x = -3 to 2 before a plane that shines, under parallel rays: a place is dark
// for the part of the time that the bar needs to pass it. The bar moves, or the mesh does.
TEST(MotionBlur, ABarDarkensEachPlaceForAsLongAsItIsThere) {
  constexpr double kHalf = 1, kFrom = -3, kTo = 2;
  for (const bool bends : {false, true}) {
    for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
      TestScene s;
      const int black = s.diffuse(0);
      s.quad({-40, -20, 5}, {0, 40, 0}, {40, 0, 0}, black, {.radiance = {1, 1, 1}});
      s.quad({0, -20, 5}, {0, 40, 0}, {40, 0, 0}, black, {.radiance = {1, 1, 1}});
      s.quad({-kHalf, -20, 2}, {0, 40, 0}, {2 * kHalf, 0, 0}, black);
      ShapeDescription& bar = s.scene.shapes.back();
      if (bends) {
        bar.kind =
            MeshShape{bending(*std::get<MeshShape>(bar.kind).mesh, 2, [&](const Vec3f& p, double time) {
              return Vec3f{static_cast<float>(p.x + kFrom + (kTo - kFrom) * time), p.y, p.z};
            })};
      } else {
        bar.object_to_world = translation({kFrom, 0, 0}) * bar.object_to_world;
        bar.moves_to = ends_at(&s, translation({kTo - kFrom, 0, 0}) * bar.object_to_world);
      }
      s.camera({0, 0, 0}, {0, 0, 1}, 60).film(32, 16);
      s.scene.camera.kind = CameraKind::kOrthographic;
      s.scene.camera.screen_window = {-4, 4, -2, 2};
      const Batches b = render(s.scene, settings_for(s.scene, integrator, 4096, 1));
      for (int x = 0; x < 32; ++x) {
        double exact = 0;
        constexpr int kParts = 1000;
        for (int i = 0; i < kParts; ++i) {
          const double at = -4 + 8 * (x + (i + 0.5) / kParts) / 32;
          const double begins = std::clamp((at - kHalf - kFrom) / (kTo - kFrom), 0.0, 1.0),
                       ends = std::clamp((at + kHalf - kFrom) / (kTo - kFrom), 0.0, 1.0);
          exact += (1 - (ends - begins)) / kParts;
        }
        const Estimate e = b.mean({x, 0, x + 1, 16}, 0);
        SCOPED_TRACE(testing::Message()
                     << name_of(integrator) << (bends ? ", bends" : "") << ", column " << x);
        EXPECT_TRUE(mean_is(e, exact, {.alpha = 1e-4 / 128, .resolution = 0.1, .rounding = 2e-4}));
      }
    }
  }
}

TEST(MotionBlur, ScalingTheRoomAndTheOrderOfPacketsLeaveItsBitsAlone) {
  const SceneDescription room = moving_room().scene;
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const RenderSettings settings = settings_for(room, integrator, 16, 4);
    const auto bits = [&](const SceneDescription& s) {
      return render_batches(s, settings, 1).images[0].data;
    };
    const std::vector<float> original = bits(room);
    for (const int k : {-60, 13, 60}) EXPECT_EQ(bits(scaled_scene(room, k)), original) << k;
    EXPECT_EQ(partial_digest(render_partial(room, settings)),
              partial_digest(render_partial(room, settings, 2, PacketOrder::kScattered)));
  }
}

}  // namespace
}  // namespace lightmill::test
