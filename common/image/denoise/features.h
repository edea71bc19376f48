#pragma once
// Features: what is known of a pixel's surface with little noise.
#include <array>

#include "common/image/denoise/denoise.h"
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// Albedo (3), normal (3) and depth (1): as many as fill a vector of eight with the constant 1.
inline constexpr int kFeatures = 7;
inline constexpr int kDepthFeature = 6;

/// Those that a picture lacks are zero. Each half of the picture has its own: at an edge, or behind glass,
/// what samples say of the surface and what they say of its colour err together, and a half that knew the
/// other's features would seem to know its colour.
struct Features {
  std::array<Plane, kFeatures> of[2];
  std::array<Plane, kFeatures> variance;  // of what noise is left in either
};

/// Brings features on scales on which 1 is a great difference: depth by its logarithm. `difference` becomes
/// that of the result; it may be empty planes (no noise known). Values that are not finite become 0.
void scale_depth(Plane* depth, Plane* difference);

/// Takes noise out of features, by the mean of pixels around whose features differ by no more than noise does
/// (Buades et al., 2005; the distance is that of Rousselle et al., "Robust Denoising using Feature and Color
/// Information", 2013, equation 2). Halves are `values` + `difference` and `values` -
/// `difference`; planes of the latter may be empty. Throws DenoiseStopped.
Features filter_features(const Extent& extent, std::array<Plane, kFeatures> values,
                         const std::array<Plane, kFeatures>& difference, const DenoiseOptions& options);

}  // namespace lightmill::denoise
