#pragma once
// An image at a coarser scale: means over boxes of its pixels.
#include "common/image/image.h"

namespace lightmill {

/// The means over boxes of `side` x `side` pixels, side >= 1, of each channel. The boxes lie side by side
/// from the upper left corner on. Those that do not lie wholly in the image are left out, so there may be no
/// columns or no rows.
Image box_means(const Image& image, int side);

}  // namespace lightmill
