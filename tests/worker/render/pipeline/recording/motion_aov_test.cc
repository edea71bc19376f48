// The AOV motion against closed answers: things that fly, turn and bend, and cameras that do.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "common/film/film.h"
#include "tests/support/instanced_scene.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kSide = 32;
/// Pixels per unit of length at the wall's distance.
constexpr double kWallDistance = 3, kScale = kSide / 2 / kWallDistance;

/// Motion and position of a render, by pixel.
class MotionLayers {
 public:
  explicit MotionLayers(const SceneDescription& scene, Integrator integrator = Integrator::kPt,
                        int64_t spp = 16) {
    RenderSettings settings = settings_for(scene, integrator, spp, 2);
    settings.aovs = kAovMotion | kAovPosition | kAovAlpha;
    Film film(settings.grid);
    film.fold(render_partial(scene, settings));
    aovs_ = film.resolve_aovs();
  }
  float at(const std::string& channel, int x, int y) const {
    for (size_t c = 0; c < aovs_.channels.size(); ++c) {
      if (aovs_.channels[c] == channel) return aovs_.image.pixel(x, y)[c];
    }
    ADD_FAILURE() << "no channel " << channel;
    return NAN;
  }
  /// Calls check(world x, world y, motion x, motion y) for all pixels that are hit; their number.
  template <class Check>
  int for_each(const Check& check) const {
    int count = 0;
    for (int y = 0; y < aovs_.image.height; ++y) {
      for (int x = 0; x < aovs_.image.width; ++x) {
        if (at("A", x, y) == 0) continue;
        check(at("position.X", x, y), at("position.Y", x, y), at("motion.X", x, y), at("motion.Y", x, y));
        ++count;
      }
    }
    return count;
  }

 private:
  ChannelImage aovs_;
};

TestScene before_a_wall() {
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(kSide, kSide);
  return s;
}
/// A wall in the plane z = 3, larger than what is seen.
ShapeDescription& wall_in(TestScene* s) {
  s->quad({-30, -30, kWallDistance}, {0, 60, 0}, {60, 0, 0}, s->diffuse(0.5f));
  return s->scene.shapes.back();
}
/// 1 if the film's x grows with the world's, else -1.
double sense_of_x(const TestScene& s) {
  return camera_direction(s.scene, kSide - 1, kSide / 2).x > camera_direction(s.scene, 1, kSide / 2).x ? 1
                                                                                                       : -1;
}

TEST(MotionAov, OfAWallThatFlies) {
  TestScene s = before_a_wall();
  ShapeDescription& wall = wall_in(&s);
  wall.moves_to = ends_at(&s, translation({0.3, 0.6, 0}));
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
    const int pixels = MotionLayers(s.scene, integrator).for_each([&](float, float, float x, float y) {
      ASSERT_NEAR(x, sense_of_x(s) * 0.3 * kScale, 1e-3);
      ASSERT_NEAR(y, 0.6 * kScale, 1e-3);
    });
    EXPECT_EQ(pixels, kSide * kSide);
  }
}

// It is at z = 3 first, at any other place when it is hit, and at z = 2 last.
TEST(MotionAov, OfAWallThatComesNearer) {
  TestScene s = before_a_wall();
  wall_in(&s).moves_to = ends_at(&s, translation({0, 0, -1}));
  const double change = kSide / 2 * (1.0 / 2 - 1.0 / 3);
  MotionLayers(s.scene).for_each([&](float wx, float wy, float x, float y) {
    ASSERT_NEAR(x, sense_of_x(s) * wx * change, 2e-3);
    ASSERT_NEAR(y, wy * change, 2e-3);
  });
}

// A point that is hit at time t was R(-a t) p first and is R(a (1 - t)) p last, of which the mean over t is
// i (2 - 2 cos a) / a times p, as complex numbers.
TEST(MotionAov, OfAnInstanceThatTurns) {
  TestScene s = before_a_wall();
  constexpr double kAngle = 40;
  const int o = begin_object(&s, "wall");
  TestScene other = before_a_wall();
  add_to_object(&s, o, wall_in(&other).kind, s.diffuse(0.5f));
  instance(&s, o, {});
  s.scene.instances.back().moves_to = ends_at(&s, rotation(kAngle, {0, 0, 1}));
  const double a = kAngle * 3.14159265358979 / 180, factor = (2 - 2 * std::cos(a)) / a * kScale;
  MotionLayers(s.scene, Integrator::kPt, 256).for_each([&](float wx, float wy, float x, float y) {
    ASSERT_NEAR(x, sense_of_x(s) * -wy * factor, 0.7);
    ASSERT_NEAR(y, wx * factor, 0.7);
  });
}

// Vertices that go up by a third of their x.
TEST(MotionAov, OfAMeshThatBends) {
  TestScene s = before_a_wall();
  ShapeDescription& wall = wall_in(&s);
  wall.kind = MeshShape{bending(*std::get<MeshShape>(wall.kind).mesh, 4, [](const Vec3f& p, double time) {
    return Vec3f{p.x, p.y + static_cast<float>(time) * p.x / 3, p.z};
  })};
  const int pixels = MotionLayers(s.scene).for_each([&](float wx, float, float x, float y) {
    ASSERT_NEAR(x, 0, 1e-3);
    ASSERT_NEAR(y, wx / 3 * kScale, 2e-3);
  });
  EXPECT_EQ(pixels, kSide * kSide);
}

TEST(MotionAov, OfACameraThatFlies) {
  TestScene s = before_a_wall();
  wall_in(&s);
  const Transform stands = s.scene.camera.camera_to_world;
  s.scene.camera.moves_to = ends_at(&s, translation({0.3, 0.6, 0}) * stands);
  MotionLayers(s.scene).for_each([&](float, float, float x, float y) {
    ASSERT_NEAR(x, sense_of_x(s) * -0.3 * kScale, 1e-3);
    ASSERT_NEAR(y, -0.6 * kScale, 1e-3);
  });
  s.scene.camera.moves_to = ends_at(&s, translation({0, 0, 1}) * stands);
  const double change = kSide / 2 * (1.0 / 2 - 1.0 / 3);
  MotionLayers(s.scene).for_each([&](float wx, float wy, float x, float y) {
    ASSERT_NEAR(x, sense_of_x(s) * wx * change, 2e-3);
    ASSERT_NEAR(y, wy * change, 2e-3);
  });
}

// What goes along with the camera stands still on the film.
TEST(MotionAov, OfWhatGoesWithTheCamera) {
  TestScene s = before_a_wall();
  wall_in(&s).moves_to = ends_at(&s, translation({0.5, 0.25, 1}));
  s.scene.camera.moves_to = ends_at(&s, translation({0.5, 0.25, 1}) * s.scene.camera.camera_to_world);
  MotionLayers(s.scene).for_each([&](float, float, float x, float y) {
    ASSERT_NEAR(x, 0, 1e-3);
    ASSERT_NEAR(y, 0, 1e-3);
  });
}

// A panorama whose camera pans: the same everywhere, over its edge, too.
TEST(MotionAov, OfAPanorama) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.5f), {.inward = true});
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(32, 16);
  s.scene.camera.kind = CameraKind::kSpherical;
  s.scene.camera.mapping = SphericalMapping::kEquirectangular;
  s.scene.camera.moves_to = ends_at(&s, s.scene.camera.camera_to_world * rotation(30, {0, 1, 0}));
  const MotionLayers l(s.scene);
  const float first = l.at("motion.X", 0, 8);
  EXPECT_NEAR(std::fabs(first), 32 * 30.0 / 360, 2e-3);
  const int pixels = l.for_each([&](float, float, float x, float y) {
    ASSERT_NEAR(x, first, 5e-3);
    ASSERT_NEAR(y, 0, 5e-3);
  });
  EXPECT_EQ(pixels, 32 * 16);
}

// Of what ends behind the camera nobody can say where it is on the film; what stands still has not moved a
// bit.
TEST(MotionAov, IsZeroWhereThereIsNone) {
  TestScene s = before_a_wall();
  s.quad({-30, -30, 5}, {0, 60, 0}, {60, 0, 0}, s.diffuse(0.25f));
  const SceneDescription still = s.scene;
  MotionLayers(still).for_each([&](float, float, float x, float y) {
    ASSERT_EQ(x, 0);
    ASSERT_EQ(y, 0);
  });
  s.quad({0, -30, 3}, {0, 60, 0}, {30, 0, 0}, s.diffuse(0.5f));
  s.scene.shapes.back().moves_to = ends_at(&s, translation({0, 0, -10}));
  MotionLayers(s.scene).for_each([&](float, float, float x, float y) {
    ASSERT_EQ(x, 0);
    ASSERT_EQ(y, 0);
  });
}

TEST(MotionAov, NobodyCanTellWhoRenderedWhat) {
  TestScene s = before_a_wall();
  s.sphere({0, 0, 4}, 1, s.diffuse(0.5f));
  s.scene.shapes.back().moves_to =
      ends_at(&s, s.scene.shapes.back().object_to_world * translation({1, 0, 0}));
  wall_in(&s).object_to_world = translation({0, 0, 3});
  s.film(70, 40);
  RenderSettings settings = settings_for(s.scene, Integrator::kPt, 20, 2);
  settings.aovs = kAovMotion;
  const Partial whole = render_partial(s.scene, settings);
  EXPECT_EQ(partial_digest(whole),
            partial_digest(render_partial(s.scene, settings, 3, PacketOrder::kScattered)));
  EXPECT_EQ(decode_partial(encode_partial(whole)), whole);
  const Renderer renderer(s.scene, settings, 1);
  Film film(settings.grid), parts(settings.grid);
  film.fold(whole);
  for (const auto& [begin, end] : {std::pair{16, 20}, {5, 16}, {0, 5}}) {
    parts.fold(decode_partial(encode_partial(render_samples(renderer, begin, end))));
    parts = Film::restore(parts.snapshot());
  }
  EXPECT_EQ(film.resolve_aovs().image.data, parts.resolve_aovs().image.data);
  Partial lies = whole;
  lies.aovs.layers[kMotionLayer][3].c[2] = 21;  // more hits than samples
  EXPECT_THROW(encode_partial(lies), std::exception);
}

}  // namespace
}  // namespace lightmill::test
