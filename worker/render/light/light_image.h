#pragma once
// Images that lights shine by: read, decoded to linear RGB and checked.
#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

struct LightImage {
  std::string path;
  int32_t width = 0, height = 0;
  std::vector<float> rgb;  // 3 per texel, row-major from the top; finite, not negative

  /// Mean over texels and channels.
  double mean() const;
  /// Sets every texel to the mean of its channels.
  void make_grey();
};

/// Reads `path`: any format of the image library. Integers of any size count as sRGB (a QOI file may say that
/// it is linear), one channel as grey; alpha does not count. `what` is its name in messages ("environment
/// image"). Throws Error(kBadScene) if it can't be read or has more than `max_side` texels a side; and,
/// naming the texel, for values that are no radiance: NaN, infinity, and negative ones beyond a filter's
/// ringing, which counts as 0.
LightImage read_light_image(const std::string& path, const std::string& what, int max_side = 8192);

/// The columns of a rotation (or a mirrored one) without its scale, row-major by the light's axes: to_light[3
/// i + j] is the j-th world component of axis i. Throws Error(kBadScene) if the transform is singular.
void light_axes(const Transform& light_to_world, const std::string& path, float to_light[9]);

}  // namespace lightmill
