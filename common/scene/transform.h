#pragma once
// 4x4 transforms in double: what the directives of a scene file build a CTM from. Points are columns.
#include <array>

#include "common/scene/description.h"

namespace lightmill {

/// a * b: first b, then a.
Transform operator*(const Transform& a, const Transform& b);
Transform translation(const Vec3d& by);
Transform scaling(const Vec3d& by);
/// Rotation by `degrees` about `axis` (any non-zero length), right-handed.
Transform rotation(double degrees, const Vec3d& axis);
/// pbrt's LookAt: the world-to-camera transform; camera space looks along +z with +y up and +x right.
/// The arguments must not be degenerate (see look_at_is_degenerate).
Transform look_at(const Vec3d& eye, const Vec3d& target, const Vec3d& up);
/// eye == target, or `up` parallel to the view direction.
bool look_at_is_degenerate(const Vec3d& eye, const Vec3d& target, const Vec3d& up);
/// From pbrt's 16 numbers, column by column.
Transform from_columns(const std::array<double, 16>& numbers);

/// Inverse of an affine, non-singular transform.
Transform inverse(const Transform& t);
/// Determinant of the upper 3x3 part.
double determinant3(const Transform& t);
/// Largest entry that a transform may have: float's range, within which determinants stay inside double's.
inline constexpr double kLargestEntry = 1e38;
bool is_in_range(const Transform& t);
/// Last row is 0 0 0 1.
bool is_affine(const Transform& t);
/// The 3x3 part has (numerically) no inverse: |det| is below 1e-12 of the product of its row lengths.
bool is_singular(const Transform& t);
/// Keeps the shape of things: rotation, mirror and one scale for all axes, within 1e-4.
bool is_similarity(const Transform& t);
Vec3d transform_point(const Transform& t, const Vec3d& p);
Vec3d transform_vector(const Transform& t, const Vec3d& v);

Vec3d cross(const Vec3d& a, const Vec3d& b);
double length(const Vec3d& v);

}  // namespace lightmill
