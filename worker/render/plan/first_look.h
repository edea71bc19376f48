#pragma once
// A first picture of a scene, to look at while its pilot chooses how to sample. No part of the image.
#include <functional>

#include "common/image/image.h"
#include "worker/render/renderer.h"

namespace lightmill {

inline constexpr int kFirstLookSide = 256;

/// A few samples of some pixels, by path tracing: the crop window at no more than kFirstLookSide pixels a
/// side. The same for any number of `threads`. Without pixels if camera paths find no light here. Throws
/// Error(kFailed) once `go_on` gives false.
Image first_look(const Renderer& renderer, int threads, const std::function<bool()>& go_on);

}  // namespace lightmill
