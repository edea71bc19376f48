#include "common/scene/transform.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

void expect_matrix_near(const Vec3d& a, const Vec3d& b) {
  EXPECT_NEAR(a.x, b.x, 1e-12);
  EXPECT_NEAR(a.y, b.y, 1e-12);
  EXPECT_NEAR(a.z, b.z, 1e-12);
}

TEST(Transform, ProductAppliesTheRightFactorFirst) {
  const Transform t = translation({1, 2, 3}) * scaling({2, 2, 2});
  expect_matrix_near(transform_point(t, {1, 1, 1}), {3, 4, 5});
  expect_matrix_near(transform_vector(t, {1, 1, 1}), {2, 2, 2});
}

TEST(Transform, RotationIsRightHanded) {
  expect_matrix_near(transform_point(rotation(90, {0, 0, 5}), {1, 0, 0}), {0, 1, 0});
  expect_matrix_near(transform_point(rotation(90, {0, 1, 0}), {0, 0, 1}), {1, 0, 0});
  EXPECT_NEAR(determinant3(rotation(33, {1, 2, 3})), 1, 1e-12);
}

TEST(Transform, InverseUndoes) {
  const Transform t = translation({1, -2, 3}) * rotation(40, {1, 1, 0}) * scaling({2, 0.5, -3});
  const Transform back = inverse(t) * t;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) EXPECT_NEAR(back.m[i][j], i == j ? 1 : 0, 1e-12);
  }
}

TEST(Transform, LookAtPutsTheTargetOnTheAxis) {
  const Transform t = look_at({0, 1, 6.8}, {0, 1, 0}, {0, 1, 0});
  expect_matrix_near(transform_point(t, {0, 1, 6.8}), {0, 0, 0});
  expect_matrix_near(transform_point(t, {0, 1, 0}), {0, 0, 6.8});
  // pbrt's camera is left-handed: looking along -z with y up, +x of the world is on the left.
  expect_matrix_near(transform_vector(t, {1, 0, 0}), {-1, 0, 0});
  expect_matrix_near(transform_vector(t, {0, 1, 0}), {0, 1, 0});
}

TEST(Transform, Degenerate) {
  EXPECT_TRUE(look_at_is_degenerate({0, 0, 0}, {0, 0, 0}, {0, 1, 0}));
  EXPECT_TRUE(look_at_is_degenerate({0, 0, 0}, {0, 2, 0}, {0, 1, 0}));
  EXPECT_FALSE(look_at_is_degenerate({0, 0, 0}, {0, 0, 1e-6}, {0, 1, 0}));
  EXPECT_TRUE(is_singular(scaling({1, 0, 1})));
  EXPECT_FALSE(is_singular(scaling({1e-20, 1e20, 1})));
  EXPECT_FALSE(is_singular(scaling({1e200, 1e200, 1e200})));
  EXPECT_FALSE(is_in_range(scaling({1e200, 1, 1})));
}

TEST(Transform, SixteenNumbersAreColumns) {
  const Transform t = from_columns({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1});
  expect_matrix_near(transform_point(t, {0, 0, 0}), {7, 8, 9});
  EXPECT_TRUE(is_affine(t));
}

TEST(Transform, FlippedNormals) {
  ShapeDescription mesh{MeshShape{}, Transform{}, false, 0, -1, {}};
  EXPECT_FALSE(surface_flips_normal(mesh));
  mesh.object_to_world = scaling({-1, 1, 1});
  EXPECT_TRUE(surface_flips_normal(mesh));
  mesh.reverse_orientation = true;
  EXPECT_FALSE(surface_flips_normal(mesh));
  ShapeDescription sphere{SphereShape{}, scaling({-1, 1, 1}), false, 0, -1, {}};
  EXPECT_FALSE(surface_flips_normal(sphere)) << "outward stays outward under a mirror";
  sphere.reverse_orientation = true;
  EXPECT_TRUE(surface_flips_normal(sphere));
}

}  // namespace
}  // namespace lightmill
