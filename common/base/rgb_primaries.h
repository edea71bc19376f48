#pragma once
// Linear RGB spaces by what their red, green, blue and white are, and the matrices between them.
#include <array>
#include <optional>

namespace lightmill {

/// CIE 1931 xy of each.
struct RgbPrimaries {
  using Point = std::array<double, 2>;
  Point red, green, blue, white;
};

/// ITU-R BT.709, whose primaries sRGB has, too; BT.2020; SMPTE ST 2065-1 (AP0); the Academy's S-2014-004
/// (AP1).
inline constexpr RgbPrimaries kRec709Primaries{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};
inline constexpr RgbPrimaries kRec2020Primaries{
    {0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}};
inline constexpr RgbPrimaries kAp0Primaries{
    {0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, {0.32168, 0.33767}};
inline constexpr RgbPrimaries kAp1Primaries{
    {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}};

/// Within 0.001 of each other in every coordinate: files round them.
bool are_same(const RgbPrimaries& a, const RgbPrimaries& b);

/// Rows; a colour is a column.
using RgbMatrix = std::array<std::array<double, 3>, 3>;

/// Between the space's linear RGB, whose white is (1, 1, 1), and XYZ, where that has luminance 1. Nothing if
/// it is no RGB space: its primaries lie on a line, or its white is no mixture of them.
std::optional<RgbMatrix> rgb_to_xyz(const RgbPrimaries& space);
std::optional<RgbMatrix> xyz_to_rgb(const RgbPrimaries& space);
/// The colour `v` times the matrix.
std::array<double, 3> transformed(const RgbMatrix& m, const std::array<double, 3>& v);

/// From linear RGB of one space to linear RGB of the other. White becomes white: where they differ, as of D65
/// and D60, by Bradford's adaptation (Lam 1985). Nothing if either is no RGB space.
std::optional<RgbMatrix> rgb_conversion(const RgbPrimaries& from, const RgbPrimaries& to);

/// The colour `rgb` times the matrix, in place. Units stay.
void convert_color(const RgbMatrix& m, float rgb[3]);

}  // namespace lightmill
