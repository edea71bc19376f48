#pragma once
// The linear RGB spaces that an .exr can be written in. Pictures in memory are linear Rec.709.
#include <optional>
#include <string>
#include <vector>

#include "common/base/rgb_primaries.h"

namespace lightmill {

enum class ImageSpace {
  kRec709,    // D65: sRGB's primaries
  kAcesCg,    // AP1, D60
  kAces2065,  // AP0, D60
  kRec2020,   // D65
};

/// "rec709", "acescg", "aces2065-1", "rec2020": the options of --colorspace.
const std::vector<std::string>& image_space_names();
const std::string& image_space_name(ImageSpace space);
/// Throws Error(kUsage) for any other name.
ImageSpace image_space_named(const std::string& name);
const RgbPrimaries& primaries_of(ImageSpace space);
/// Which of them has the primaries; nothing if none has.
std::optional<ImageSpace> image_space_of(const RgbPrimaries& primaries);
/// The name that programs know it by, whatever their configuration: the attribute colorInteropID of an .exr
/// (Color Interop Forum, "Color space encodings for texture assets and CG rendering", 2024).
const char* interop_id(ImageSpace space);

}  // namespace lightmill
