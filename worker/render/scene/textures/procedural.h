#pragma once
// pbrt-v4's textures that are functions of the point alone, and the mappings of points to texture space. Bits
// are fixed: no library function but floor, fmod and sqrt.
#include "worker/render/scene/textures/texture.h"

namespace lightmill {

struct MappedPoint {
  float s = 0, t = 0;
};
MappedPoint map_point(const UvMapping& mapping, const TexturePoint& at);

/// Whether the point lies on the board's tex2.
bool second_square(const CheckerboardTexture& board, const TexturePoint& at);
Rgb bilerp(const BilerpTexture& texture, const TexturePoint& at);
/// Every other cell of the unit grid or so has a dot of radius 0.35, shifted within the cell.
bool inside_dot(const MappedPoint& at);
/// Floats come as grey.
Rgb noise_color(const NoiseTexture& texture, const TexturePoint& at);

}  // namespace lightmill
