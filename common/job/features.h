#pragma once
// Parts of the renderer that the scene plan leaves out where a scene does not need them. `--plan-override`
// switches them back on by these names. A feature that is not needed does not change the image's bits. A
// strategy makes another estimate of the same image.
#include <string>

#include "common/job/strategies.h"

namespace lightmill {

/// A set of features: their sum. The lowest bits are the families of strategies.
using Features = unsigned;
inline constexpr Features kTextures = 1u << 4;
inline constexpr Features kTextureCoordinates = 1u << 5;
inline constexpr Features kShadingNormals = 1u << 6;
inline constexpr Features kBumps = 1u << 7;
inline constexpr Features kAnisotropicLobes = 1u << 8;
inline constexpr Features kMixes = 1u << 9;
inline constexpr Features kAlphaMasks = 1u << 10;
inline constexpr Features kMaterialSort = 1u << 11;
inline constexpr Features kDeltaLights = 1u << 12;
inline constexpr Features kGeneralKernels = 1u << 13;
inline constexpr Features kAllFeatures = (1u << 14) - 1;

/// "textures,light-tracing", those in the set, in the order of their bits; empty for none.
std::string feature_names(Features set);
/// Inverse; throws Error(kUsage) on a name that does not exist, listing those that do.
Features features_named(const std::string& names);

}  // namespace lightmill
