// What moves: the way between two transforms, and ActiveTransform, TransformTimes and the shutter of pbrt
// files.
#include "common/scene/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

void expect_near(const Transform& a, const Transform& b, double error = 1e-12) {
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) EXPECT_NEAR(a.m[i][j], b.m[i][j], error) << i << ", " << j;
  }
}

TEST(Motion, EndsAreTheTransformsThemselves) {
  const Transform a = rotation(20, {1, 2, 3}) * scaling({0.1, 3, 7}),
                  b = translation({1, 2, 3}) * rotation(70, {3, 1, 0});
  const Motion motion(a, b);
  EXPECT_EQ(motion.at(0).m, a.m);
  EXPECT_EQ(motion.at(1).m, b.m);
  EXPECT_EQ(motion.at(-1).m, a.m);
  EXPECT_EQ(motion.at(2).m, b.m);
}

TEST(Motion, TranslationsGoStraightAndKeepTheRest) {
  const Transform turn = rotation(33, {1, 2, 3}) * scaling({-1, 2, 5});
  const Transform a = translation({1, 2, 3}) * turn, b = translation({5, 2, -1}) * turn;
  Transform middle = turn;
  middle.m[0][3] = 2, middle.m[1][3] = 2, middle.m[2][3] = 2;
  EXPECT_EQ(Motion(a, b).at(0.25).m, middle.m);
  EXPECT_EQ(Motion(a, b).degrees(), 0);
  EXPECT_TRUE(Motion(a, b).is_rigid());
}

TEST(Motion, RotationsTurnEvenlyTheShorterWayRound) {
  const Transform first = rotation(50, {1, -2, 0.5});
  for (const double degrees : {1e-6, 1.0, 90.0, 179.0, 179.999}) {
    for (const double sign : {-1.0, 1.0}) {
      const Motion motion(first, rotation(sign * degrees, {1, 2, 3}) * first);
      EXPECT_NEAR(motion.degrees(), degrees, 1e-9);
      EXPECT_TRUE(motion.is_rigid());
      for (const double s : {0.1, 0.5, 0.9})
        expect_near(motion.at(s), rotation(sign * s * degrees, {1, 2, 3}) * first);
    }
  }
  expect_near(Motion({}, rotation(270, {0, 0, 1})).at(0.5), rotation(-45, {0, 0, 1}));
  // Half a turn has two ways of the same length; either is one.
  const Transform half = Motion({}, rotation(180, {1, 1, 0})).at(0.5);
  EXPECT_NEAR(std::fabs(half.m[2][0]), std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(determinant3(half), 1, 1e-12);
}

TEST(Motion, StretchesChangeEvenlyBeneathTheTurn) {
  const Transform a = scaling({1, 2, 4}), b = rotation(60, {0, 1, 0}) * scaling({3, 2, 1e-3});
  const Motion motion(a, b);
  EXPECT_FALSE(motion.is_rigid());
  expect_near(motion.at(0.5), rotation(30, {0, 1, 0}) * scaling({2, 2, 2.0005}));
  // However stretched.
  const Transform c = rotation(30, {1, 2, 3}) * scaling({1e6, 1, 1e-6}) * rotation(20, {3, 1, 2});
  EXPECT_NEAR(Motion(c, rotation(40, {1, 0, 0}) * c).degrees(), 40, 1e-3);
}

TEST(Motion, MirrorsMoveAsWhatTheyShow) {
  const Transform mirror = scaling({-1, 1, 1});
  const Motion motion(mirror, rotation(80, {1, 2, 3}) * mirror);
  expect_near(motion.at(0.5), rotation(40, {1, 2, 3}) * mirror);
  EXPECT_TRUE(motion.is_rigid());
  EXPECT_FALSE(can_move({}, mirror));
  EXPECT_TRUE(can_move(mirror, scaling({1, 1, -2})));
}

TEST(Motion, APartOfTheWayIsTheWayBetweenItsEnds) {
  const Transform a = translation({1, 2, 3}) * rotation(20, {1, 2, 3}) * scaling({1, 2, 3}),
                  b = rotation(130, {3, 1, 2}) * scaling({2, 2, 1});
  const Motion whole(a, b), part(whole.at(0.2), whole.at(0.7));
  for (const double s : {0.3, 0.5, 0.8}) expect_near(part.at(s), whole.at(0.2 + 0.5 * s), 1e-10);
}

class MovingThings : public SceneTest {};

constexpr const char* kMovedSphere =
    "ActiveTransform EndTime Translate 4 0 0 ActiveTransform All Shape \"sphere\"";

double end_x(const SceneDescription& s, int moves_to) {
  return s.later.at(static_cast<size_t>(moves_to)).m[0][3];
}

TEST_F(MovingThings, ShapesHaveTwoTransforms) {
  const SceneDescription s =
      clean_world("Translate 1 0 0\n" + std::string(kMovedSphere) +
                  "\nShape \"sphere\" ActiveTransform StartTime Translate 0 1 0 Shape \"sphere\" "
                  "AttributeBegin Identity Shape \"sphere\" AttributeEnd "
                  "ActiveTransform All Translate 0 0 1 Shape \"sphere\" Identity Shape \"sphere\"");
  ASSERT_EQ(s.shapes.size(), 6u);
  EXPECT_EQ(s.shapes[0].object_to_world.m[0][3], 1);
  EXPECT_EQ(end_x(s, s.shapes[0].moves_to), 5);
  EXPECT_EQ(s.shapes[1].moves_to, s.shapes[0].moves_to) << "they move together";
  EXPECT_NE(s.shapes[2].moves_to, s.shapes[0].moves_to);
  EXPECT_EQ(s.shapes[2].object_to_world.m[1][3], 1);
  EXPECT_EQ(end_x(s, s.shapes[2].moves_to), 5);
  EXPECT_EQ(s.shapes[3].object_to_world.m[0][3], 0) << "Identity is for the start alone";
  EXPECT_EQ(end_x(s, s.shapes[3].moves_to), 5);
  EXPECT_EQ(s.shapes[4].object_to_world.m[2][3], 1);
  EXPECT_EQ(s.later.at(static_cast<size_t>(s.shapes[4].moves_to)).m[2][3], 1);
  EXPECT_EQ(s.shapes[5].moves_to, -1);
  EXPECT_EQ(s.shutter.moves_from, 0);
  EXPECT_EQ(s.shutter.moves_until, 1);
}

TEST_F(MovingThings, ScopesAndCoordinateSystemsHaveBoth) {
  const SceneDescription s = clean_world(
      "AttributeBegin ActiveTransform EndTime Translate 2 0 0 CoordinateSystem \"there\" AttributeEnd\n"
      "Shape \"sphere\" CoordSysTransform \"there\" Shape \"sphere\" "
      "CoordSysTransform \"world\" Shape \"sphere\"");
  ASSERT_EQ(s.shapes.size(), 3u);
  EXPECT_EQ(s.shapes[0].moves_to, -1);
  EXPECT_EQ(end_x(s, s.shapes[1].moves_to), 2);
  EXPECT_EQ(s.shapes[2].moves_to, -1);
}

TEST_F(MovingThings, InstancesAndShapesInObjects) {
  const SceneDescription s =
      clean_world("ObjectBegin \"o\" " + std::string(kMovedSphere) +
                  " ObjectEnd\nActiveTransform EndTime Translate 0 3 0 ObjectInstance \"o\"");
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(end_x(s, s.objects[0].shapes[0].moves_to), 4);
  ASSERT_EQ(s.instances.size(), 1u);
  EXPECT_EQ(s.later.at(static_cast<size_t>(s.instances[0].moves_to)).m[1][3], 3);
}

TEST_F(MovingThings, TheCameraMoves) {
  const SceneDescription s = clean(load(
      "Translate 0 0 5 ActiveTransform EndTime Translate -1 0 0 ActiveTransform All Camera \"perspective\"\n"
      "WorldBegin LightSource \"point\" CoordSysTransform \"camera\" Shape \"sphere\""));
  EXPECT_EQ(s.camera.camera_to_world.m[2][3], -5);
  EXPECT_EQ(end_x(s, s.camera.moves_to), 1);
  EXPECT_EQ(end_x(s, s.shapes.at(0).moves_to), 1) << "what hangs on the camera moves along";
}

TEST_F(MovingThings, TimesAreThoseOfTheShutter) {
  const auto at = [&](const char* times, const char* open, const char* close) {
    return clean(load("TransformTimes " + std::string(times) +
                      " Camera \"perspective\" \"float shutteropen\" " + open + " \"float shutterclose\" " +
                      close + " WorldBegin LightSource \"point\" " + kMovedSphere));
  };
  // Within the motion: a part of the way.
  SceneDescription s = at("10 20", "12", "17");
  EXPECT_NEAR(s.shapes[0].object_to_world.m[0][3], 0.8, 1e-12);
  EXPECT_NEAR(end_x(s, s.shapes[0].moves_to), 2.8, 1e-12);
  EXPECT_EQ(s.shutter.moves_from, 0);
  EXPECT_EQ(s.shutter.moves_until, 1);
  EXPECT_EQ(s.film.imaging_ratio, 5);
  // Beyond it: things stand still before and after.
  s = at("0 1", "-1", "3");
  EXPECT_EQ(s.shapes[0].object_to_world.m[0][3], 0);
  EXPECT_EQ(end_x(s, s.shapes[0].moves_to), 4);
  EXPECT_EQ(s.shutter.moves_from, 0.25);
  EXPECT_EQ(s.shutter.moves_until, 0.5);
  // Before and after it nothing moves.
  s = at("0 1", "-3", "-2");
  EXPECT_EQ(s.shapes[0].moves_to, -1);
  EXPECT_EQ(s.shapes[0].object_to_world.m[0][3], 0);
  s = at("0 1", "1", "2");
  EXPECT_EQ(s.shapes[0].moves_to, -1);
  EXPECT_EQ(s.shapes[0].object_to_world.m[0][3], 4);
  EXPECT_TRUE(s.later.empty());
}

/// Of TransformSteps: moves by the given x.
std::string steps_along_x(const std::vector<int>& xs) {
  std::string text = "TransformSteps " + std::to_string(xs.size()) + " [";
  for (const int x : xs) text += " 1 0 0 0  0 1 0 0  0 0 1 0  " + std::to_string(x) + " 0 0 1";
  return text + "]\n";
}

TEST_F(MovingThings, TransformsInSteps) {
  const SceneDescription s = clean_world(
      "AttributeBegin " + steps_along_x({0, 4, 5}) +
      "Shape \"sphere\" Shape \"sphere\" Scale 2 2 2 Shape \"sphere\" " + steps_along_x({0, 4, 0}) +
      "Shape \"sphere\" Identity Shape \"sphere\" AttributeEnd Shape \"sphere\"");
  ASSERT_EQ(s.shapes.size(), 6u);
  EXPECT_EQ(s.shapes[1].moves_to, s.shapes[0].moves_to) << "they move together";
  const auto x = [&](size_t i, double time) {
    return Way(s.shapes[i].object_to_world, s.shapes[i].moves_to, s).at(time).m[0][3];
  };
  EXPECT_NEAR(x(0, 0.25), 2, 1e-12);
  EXPECT_NEAR(x(0, 0.75), 4.5, 1e-12);
  EXPECT_NEAR(x(0, 1), 5, 1e-12);
  EXPECT_EQ(s.between.at(s.shapes[2].moves_to).at(0).m[0][0], 2);
  EXPECT_NEAR(x(3, 0.5), 4, 1e-12) << "it goes, and comes back";
  EXPECT_NEAR(x(3, 1), 0, 1e-12);
  EXPECT_EQ(s.shapes[4].moves_to, -1);
  EXPECT_EQ(s.shapes[5].moves_to, -1);
}

TEST_F(MovingThings, TheShutterIsOpenForSomeOfTheSteps) {
  const SceneDescription s =
      clean(load("Camera \"perspective\" \"float shutteropen\" 0.25 \"float shutterclose\" 0.75 WorldBegin "
                 "LightSource \"point\" " +
                 steps_along_x({0, 4, 0}) + "Shape \"sphere\""));
  const Way way(s.shapes[0].object_to_world, s.shapes[0].moves_to, s);
  EXPECT_NEAR(way.at(0).m[0][3], 2, 1e-12);
  EXPECT_NEAR(way.at(0.5).m[0][3], 4, 1e-12);
  EXPECT_NEAR(way.at(1).m[0][3], 2, 1e-12);
}

TEST_F(MovingThings, BadStepsAreNamed) {
  EXPECT_TRUE(has_error(load_world(steps_along_x({0, 1})), "3, 5, 9, 17, 33 or 65 matrices"));
  EXPECT_TRUE(has_error(load_world("TransformSteps 1e9 [1]"), "3, 5, 9, 17, 33 or 65 matrices"));
  EXPECT_TRUE(has_error(load_world("TransformSteps 3 [1 2]"), "finite numbers"));
  std::string flat = steps_along_x({0, 1, 2});
  flat.replace(flat.find("[ 1"), 3, "[ 0");
  EXPECT_TRUE(has_error(load_world(flat), "not singular"));
}

TEST_F(MovingThings, SpheresUnderAStretchAtEitherEndAreMeshes) {
  const SceneDescription s = clean_world(
      "ActiveTransform EndTime Scale 1 2 1 ActiveTransform All Shape \"sphere\" \"float radius\" 3");
  EXPECT_TRUE(std::holds_alternative<MeshShape>(s.shapes[0].kind));
  EXPECT_NEAR(s.shapes[0].object_to_world.m[1][1], 3, 1e-6);
  EXPECT_NEAR(s.later.at(static_cast<size_t>(s.shapes[0].moves_to)).m[1][1], 6, 1e-6);
}

TEST_F(MovingThings, LightsMove) {
  SceneDescription s = clean_world(
      "AttributeBegin ActiveTransform EndTime Translate 4 0 0 ActiveTransform All LightSource \"point\" "
      "\"point3 from\" "
      "[0 1 0] AttributeEnd\n"
      "AttributeBegin ActiveTransform EndTime Rotate 90 0 1 0 ActiveTransform All LightSource \"spot\" "
      "\"point3 from\" "
      "[2 0 0] \"point3 to\" [3 0 0] AttributeEnd Shape \"sphere\"");
  std::erase_if(s.lights, [](const LightDescription& l) { return l.later.empty(); });
  ASSERT_EQ(s.lights.size(), 2u);
  const auto point = [](const LightKind& l) { return std::get<PointLight>(l).position; };
  EXPECT_EQ(point(s.lights[0].kind).x, 0);
  ASSERT_EQ(s.lights[0].later.size(), 1u);
  EXPECT_NEAR(point(s.lights[0].later[0]).x, 4, 1e-12);
  EXPECT_NEAR(point(s.lights[0].later[0]).y, 1, 1e-12);
  const size_t steps = s.lights[1].later.size();
  ASSERT_GE(steps, 32u);
  for (size_t i = 1; i <= steps; ++i) {
    const auto& spot = std::get<SpotLight>(s.lights[1].later[i - 1]);
    const double angle = std::numbers::pi / 2 * static_cast<double>(i) / static_cast<double>(steps);
    EXPECT_NEAR(spot.position.x, 2 * std::cos(angle), 1e-6);
    EXPECT_NEAR(spot.position.z, -2 * std::sin(angle), 1e-6);
    EXPECT_NEAR(spot.direction.x, std::cos(angle), 1e-6);
    EXPECT_NEAR(spot.direction.z, -std::sin(angle), 1e-6);
  }
}

TEST_F(MovingThings, MeshesThatEmitMove) {
  const LoadResult r =
      load_world("AreaLightSource \"diffuse\" ActiveTransform EndTime Translate 1 0 0\nShape \"disk\"");
  EXPECT_EQ(listed(r), "");
  ASSERT_EQ(r.scene.shapes.size(), 1u);
  EXPECT_GE(r.scene.shapes[0].area_light, 0);
  EXPECT_GE(r.scene.shapes[0].moves_to, 0);
}

TEST_F(MovingThings, SpheresThatEmitMoveAsMeshesOfTheirArea) {
  const LoadResult r = load_world(
      "AreaLightSource \"diffuse\" ActiveTransform EndTime Translate 1 0 0\nShape \"sphere\" \"float "
      "radius\" 2");
  EXPECT_EQ(listed(r), "");
  ASSERT_EQ(r.scene.shapes.size(), 1u);
  const ShapeDescription& s = r.scene.shapes[0];
  EXPECT_GE(s.area_light, 0);
  ASSERT_GE(s.moves_to, 0);
  ASSERT_TRUE(std::holds_alternative<MeshShape>(s.kind));
  EXPECT_NEAR(mesh_area(*std::get<MeshShape>(s.kind).mesh, s.object_to_world), 4 * M_PI * 4, 1e-3);
  EXPECT_EQ(r.scene.later[static_cast<size_t>(s.moves_to)].m[0][3], 1);
  EXPECT_EQ(r.scene.later[static_cast<size_t>(s.moves_to)].m[0][0], s.object_to_world.m[0][0]);
}

TEST_F(MovingThings, WhatCannotMoveStays) {
  const std::pair<const char*, const char*> cases[] = {
      {"ActiveTransform EndTime Translate 1 0 0\nLightSource \"infinite\"",
       "a light of this kind that moves"},
      {"ActiveTransform EndTime Translate 1 0 0\nTexture \"t\" \"float\" \"constant\"", "a texture's space"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = load_world(text);
    EXPECT_TRUE(r.ok()) << listed(r);
    EXPECT_TRUE(mentions(r, message)) << listed(r);
    EXPECT_TRUE(mentions(r, "stays as at its start time")) << listed(r);
    EXPECT_TRUE(mentions(r, "scene.pbrt:3:")) << listed(r);
    for (const ShapeDescription& s : r.scene.shapes) EXPECT_EQ(s.moves_to, -1);
  }
  const LoadResult r = load(
      "ActiveTransform EndTime Scale 2 2 2 ActiveTransform All\nCamera \"perspective\"\n"
      "WorldBegin LightSource \"point\" Shape \"sphere\"");
  EXPECT_TRUE(mentions(r, "a camera whose Scale changes")) << listed(r);
  EXPECT_EQ(r.scene.camera.moves_to, -1);
}

TEST_F(MovingThings, BadMotionIsRefused) {
  const std::pair<const char*, const char*> cases[] = {
      {"ActiveTransform EndTime\nScale 1 0 1 Shape \"sphere\"", "is singular"},
      {"ActiveTransform EndTime\nTranslate nan 0 0 Shape \"sphere\"", "finite numbers"},
      {"ActiveTransform EndTime\nTransform [1 0 0 0  2 0 0 0  0 0 1 0  0 0 0 1]", "is singular"},
      {"ActiveTransform EndTime Scale -1 1 1\nShape \"sphere\"", "turned inside out"},
      {"ActiveTransform EndTime Translate 1e38 0 0\nShape \"sphere\"", "outside the range of numbers"},
      {"\nTransformTimes 0 1", "must come before WorldBegin"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = strictly_world(text);
    EXPECT_TRUE(has_error(r, message)) << text;
    EXPECT_TRUE(mentions(r, "scene.pbrt:3:")) << listed(r);
  }
  for (const char* times : {"1 0", "1 1", "0 nan", "0"}) {
    const LoadResult r = load("TransformTimes " + std::string(times) + " WorldBegin LightSource \"point\"");
    EXPECT_TRUE(has_error(r, "TransformTimes needs")) << times;
  }
}

}  // namespace
}  // namespace lightmill
