#pragma once
// Which channels of a picture are colours, and their conversion to other primaries.
#include "common/base/rgb_primaries.h"
#include "common/image/image.h"

namespace lightmill {

/// Multiplies the colours by the matrix: every layer of channels R, G and B, but for those whose names say
/// that they hold something else (normals, positions, Cryptomatte, ...). Differences of colours are colours.
/// A layer `variance` is taken away: it holds a square for each channel, and those of other primaries do not
/// follow from it.
void convert_colors(ChannelImage* image, const RgbMatrix& m);

/// Whether convert_colors would take a layer away.
bool has_variance(const std::vector<std::string>& channels);

}  // namespace lightmill
