#include "coordinator/web/denoised/denoised_picture.h"

#include <algorithm>
#include <utility>

#include "common/image/denoise/denoise.h"
#include "common/image/denoise/layers.h"

namespace lightmill {
namespace {

int blocks_in(int pixels, int block) { return (pixels + block - 1) / block; }

/// The side of the largest picture made by reduced() that has at most so many pixels; and its blocks.
std::pair<int, int> side_and_block(const Image& image, int64_t most_pixels) {
  const int longer = std::max(image.width, image.height);
  for (int wanted = 1;; ++wanted) {
    const int side = blocks_in(longer, wanted), block = blocks_in(longer, side);
    if (side == 1 || int64_t{blocks_in(image.width, block)} * blocks_in(image.height, block) <= most_pixels) {
      return {side, block};
    }
  }
}

std::string names_of(const DenoiseLayers& layers) {
  std::string names;
  const auto add = [&](bool there, const char* name) {
    if (there) names += (names.empty() ? "" : ",") + std::string(name);
  };
  add(layers.has_difference, "difference");
  add(layers.has_albedo, "albedo");
  add(layers.has_normal, "normal");
  add(layers.has_depth, "depth");
  return names;
}

}  // namespace

DenoisedPicture denoised_picture(Image image, ChannelImage layers, int64_t most_pixels,
                                 const std::stop_token& stop) {
  const auto [side, block] = side_and_block(image, most_pixels);
  DenoisedPicture picture;
  picture.block = block;
  if (block > 1) {
    image = reduced(image, side);
    if (!layers.channels.empty()) layers.image = reduced(layers.image, side);
  }
  DenoiseLayers found = find_denoise_layers(as_channels(image, layers), "the job's image");
  layers = {};
  picture.layers = names_of(found);
  const DenoiseResult result = denoise_picture(std::move(found.input), {.threads = 1, .stop = stop});
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = result.colour[i % 3][i / 3];
  picture.relmse = result.relmse;
  picture.relmse_raw = result.relmse_raw;
  picture.image = std::make_shared<const Image>(std::move(image));
  return picture;
}

}  // namespace lightmill
