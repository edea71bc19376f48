#pragma once
// Fills the pixels of an image that have no value yet, to look at it.
#include <cstdint>
#include <vector>

#include "common/image/image.h"

namespace lightmill {

/// Gives every pixel that is not `known` (one entry per pixel) a mean of the known ones around it: pull and
/// push over a pyramid (Gortler et al., "The Lumigraph", 1996, section 3.5). Nothing changes if none is
/// known.
void fill_holes(const std::vector<uint8_t>& known, Image* image);

}  // namespace lightmill
