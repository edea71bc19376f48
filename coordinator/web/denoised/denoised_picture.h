#pragma once
// One picture of a job without most of its noise, as it is shown beside the raw one.
#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>

#include "common/image/image.h"

namespace lightmill {

struct DenoisedPicture {
  std::shared_ptr<const Image> image;
  int block = 1;                      // a pixel is the mean of so many by so many of the job's image
  double relmse = 0, relmse_raw = 0;  // estimates for this picture: what is left, and what was there before
  std::string layers;                 // that it went by: "difference,albedo,normal,depth", or some of them
};

/// Denoises on this thread alone. `layers` are the image's AOVs, maybe without channels. What has more than
/// `most_pixels` is reduced first, layers and all: means of their values are those of the smaller picture, as
/// a difference of means is the mean of differences. Throws DenoiseStopped.
DenoisedPicture denoised_picture(Image image, ChannelImage layers, int64_t most_pixels,
                                 const std::stop_token& stop);

}  // namespace lightmill
