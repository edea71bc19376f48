#pragma once
// Light groups: a picture's light, one layer for each group of the lights that it came from.
//
//   const ChannelImage file = read_channels("a.exr", max_pixels);
//   const LightLayers lights = find_light_layers(file, "a.exr");
//   for (const LightShare& s : light_shares(file, lights)) std::printf("%s\n", s.name.c_str());
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image.h"

namespace lightmill {

/// Numbers of the channels of a file that hold red, green and blue.
using RgbChannels = std::array<size_t, 3>;

struct LightLayer {
  std::string name;
  RgbChannels colour{};                   // radiance
  std::optional<RgbChannels> difference;  // as the AOV `difference` (common/job/aovs.h), of this group alone
};

/// What a file has of light groups. All of it adds up to the picture.
struct LightLayers {
  RgbChannels picture{};                  // the colour as it was rendered
  std::optional<RgbChannels> difference;  // of the picture
  std::vector<LightLayer> groups;         // in the file's order, but "rest" last
  /// The name of the light that is in none of the groups' layers: picture - groups. Empty: there is none.
  std::string rest;

  /// The groups' names and then that of the rest: the order of everything that is given for each group.
  std::vector<std::string> names() const;
};

/// Layers are called `lightgroup_NAME` (Lightmill), else `Combined_NAME` (Blender), `RGBA_NAME` (Arnold) or
/// `C_NAME` (Karma), with or without the name of a view layer and a dot before them. Only the first of these
/// that a file has are its groups. Of a picture that was denoised the layer `raw` is the colour.
///
/// Lightmill's layers are all of the light, so there is a rest only if they lack more than 1 % of the
/// picture; that is more than half floats round away. Others may have lights in no group: there is always a
/// rest.
///
/// Throws Error(kUsage), naming the file as `path`, if there are no groups, no colour, or not all three
/// channels of a layer.
LightLayers find_light_layers(const ChannelImage& file, const std::string& path);

struct LightShare {
  std::string name;
  std::array<double, 3> mean{};  // radiance, over the pixels that are finite in all groups
  std::optional<double> share;   // of the picture's mean luminance; none if that is not above 0
};
/// In the order of names().
std::vector<LightShare> light_shares(const ChannelImage& file, const LightLayers& lights);

}  // namespace lightmill
