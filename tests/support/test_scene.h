#pragma once
// Scenes for tests, made in code.
//
//   TestScene s;
//   const int grey = s.diffuse(0.5f);
//   s.box({-1, -1, -1}, {1, 1, 1}, grey, {.radiance = {1, 1, 1}, .inward = true});
//   s.camera({0, 0, 0}, {0, 0, 1}, 60).film(8, 8);
//   render_batches(s.scene, ...)
#include "common/scene/description.h"
#include "common/scene/transform.h"

namespace lightmill::test {

Vec3d operator+(const Vec3d& a, const Vec3d& b);
Vec3d operator-(const Vec3d& a, const Vec3d& b);
Vec3d operator*(const Vec3d& a, double s);
double dot(const Vec3d& a, const Vec3d& b);
Vec3d normalized(const Vec3d& a);

/// What a shape emits and which way it faces.
struct Emits {
  Rgb radiance{};
  bool two_sided = false;
  bool inward = false;  // boxes and spheres: the outside normal points to the inside
};

/// Every adder of a material returns its index.
struct TestScene {
  SceneDescription scene;

  TestScene();
  int diffuse(float reflectance) { return diffuse(Rgb{reflectance, reflectance, reflectance}); }
  int diffuse(const Rgb& reflectance);
  /// Reflects `r` at normal incidence (eta = 1).
  int conductor(float r, float alpha);
  int dielectric(float eta, float alpha);
  int thin_dielectric(float eta);
  int diffuse_transmission(const Rgb& reflectance, const Rgb& transmittance);
  int coated(const Rgb& reflectance, float eta, float alpha);
  /// `second` with probability `amount`, else `first`.
  int mix(int first, int second, float amount);
  /// Metal that reflects `reflectance` at normal incidence against air, under a coat of index `eta`.
  int coated_conductor(const Rgb& reflectance, float eta, float coat_alpha, float metal_alpha);

  /// Parallelogram p, p + u, p + u + v, p + v with normal u x v.
  TestScene& quad(const Vec3d& p, const Vec3d& u, const Vec3d& v, int material, const Emits& emits = {});
  TestScene& triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, int material, const Emits& emits = {});
  TestScene& box(const Vec3d& lo, const Vec3d& hi, int material, const Emits& emits = {});
  TestScene& sphere(const Vec3d& center, double radius, int material, const Emits& emits = {});
  TestScene& point_light(const Vec3d& position, const Rgb& intensity);
  TestScene& environment(const Rgb& radiance);
  /// Looks from `eye` to `target`; `fov` in degrees of the shorter axis. Up is +y, or +z when
  /// looking along y.
  TestScene& camera(const Vec3d& eye, const Vec3d& target, double fov);
  /// Resolution; the pixel filter is a box of one pixel.
  TestScene& film(int width, int height);

 private:
  ShapeDescription& shape(int material, const Emits& emits);
};

/// A closed room 2 x 2 x 2 around the origin: red left (x < 0), green right, a lamp below the ceiling, a
/// block on the floor; the camera is inside and looks to +z.
TestScene cornell_room();
/// Direction through raster position (x, y) of the scene's camera, in world space, in double.
Vec3d camera_direction(const SceneDescription& scene, double x, double y);
Vec3d camera_position(const SceneDescription& scene);

}  // namespace lightmill::test
