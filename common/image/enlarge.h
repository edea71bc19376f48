#pragma once
// A small picture at the size of a larger one.
#include "common/image/image.h"

namespace lightmill {

/// `from`, of three channels, at `width` x `height` >= 1 pixels: each takes the nearest one's value.
Image enlarged(const Image& from, int width, int height);

}  // namespace lightmill
