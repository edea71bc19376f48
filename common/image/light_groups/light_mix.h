#pragma once
// Relights a picture: the sum of its light groups, each times a factor.
//
//   const std::vector<LightFactor> factors = {{1.5, 1.5, 1.5}, {0.2, 0.3, 0.4}};  // as lights.names()
//   const MixedColour colour = mix_colour(file, lights, factors);
//   const MixedLayers beside = mix_layers(file, lights, factors, colour);
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "common/image/light_groups/light_factor.h"
#include "common/image/light_groups/light_layers.h"

namespace lightmill {

struct MixedColour {
  Image image;
  /// As the AOV `difference` (common/job/aovs.h): it is linear, so it is the same sum of the groups'
  /// differences. None if that of a group is not known.
  std::optional<Image> difference;
};

/// `factors` are in the order of lights.names(). A channel that all groups have the factor 1 in stays as it
/// is, to the bit. Throws std::invalid_argument for another number of factors.
MixedColour mix_colour(const ChannelImage& file, const LightLayers& lights,
                       std::span<const LightFactor> factors);

struct MixedLayers {
  /// The groups' layers times their factors, the mixed difference, and the layers of the file that say
  /// nothing of light. The colour itself is not among them.
  ChannelImage layers;
  std::vector<std::string> left_out;  // names of layers that may not be true of the mixed picture
};
MixedLayers mix_layers(const ChannelImage& file, const LightLayers& lights,
                       std::span<const LightFactor> factors, const MixedColour& colour);

}  // namespace lightmill
