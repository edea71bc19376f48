#pragma once
// From a file's channels to the denoiser's planes and back: layers by the names that renderers give them.
#include <string>

#include "common/image/denoise/denoise.h"
#include "common/image/image.h"

namespace lightmill {

/// What a file has that the denoiser can use, and how it calls it.
struct DenoiseLayers {
  DenoiseInput input;
  std::string colour, albedo, normal, depth;  // names of the layers, "" for the unnamed one
  bool has_albedo = false, has_normal = false, has_depth = false;
  bool has_difference = false;
};

/// Colour and its layers (without channels: none) as a file has them.
ChannelImage as_channels(const Image& image, const ChannelImage& layers);

/// Names are those of Lightmill, pbrt (Albedo, Ns, N), Cycles ("Denoising Albedo", "Noisy Image" and so on,
/// with or without the view layer before it), Mitsuba and Arnold; upper and lower case are one. What was
/// denoised before is denoised anew, from its layer `raw`. Throws Error(kUsage), naming the file as `path`,
/// if there is no colour.
DenoiseLayers find_denoise_layers(const ChannelImage& file, const std::string& path);

/// What a denoised file has beside its colour: `raw`, `error` (root of the estimate of the squared error,
/// mean of the channels) and all layers of the file that it was made from.
ChannelImage denoised_layers(const ChannelImage& file, const DenoiseLayers& layers,
                             const DenoiseResult& result);

}  // namespace lightmill
