#pragma once
// Writing a picture and its layers, denoised where that is asked for.
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "client/options.h"
#include "common/image/image.h"

namespace lightmill::client {

/// Estimates for a whole picture.
struct DenoiseFigures {
  bool difference = false;  // whether the noise was known from the layer `difference`, not guessed
  double relmse_raw = 0, relmse = 0;
  std::optional<double> relmse_low, relmse_high;  // the 95 % interval of relmse (DenoiseResult)
};
nlohmann::json denoise_to_json(const DenoiseFigures& figures);
/// "estimated relMSE 0.001 (95 %: 0.0008 to 0.0012), before 0.01"
std::string denoise_line(const DenoiseFigures& figures);

struct DenoisedPicture {
  Image image;
  ChannelImage layers;  // the raw colour, the estimate of the error, and the layers of the picture before
  DenoiseFigures figures;
};

/// Denoises the picture whose channels are those of a file. Warns of layers that lack, unless `quiet`,
/// calling it `name`. `spp`: the samples per pixel as the metadata have them; below those of independent
/// halves (common/job/replicates.h) there is no interval, "" is taken as enough. `interval`: there may be one
/// for pictures of more than kMostIntervalPixels, too, which takes as long once more. Throws Error(kUsage) if
/// it has no colour or too many pixels.
DenoisedPicture denoise_channels(const ChannelImage& file, const std::string& name, const std::string& spp,
                                 int threads, bool interval, bool quiet);
inline constexpr int64_t kMostIntervalPixels = int64_t{1} << 20;

/// Writes it as `output` says, with its layers if the file can hold them. Warns of a layer that can't be
/// converted to its colour space, unless `quiet`, calling the picture `name`. Throws as write_image().
void write_denoised(const OutputOptions& output, const DenoisedPicture& picture,
                    std::map<std::string, std::string> metadata, const std::string& name, bool quiet);

/// Of larger images the layers and what is made of them take more memory than most machines have.
inline constexpr int64_t kMaxDenoisePixels = int64_t{1} << 26;

/// Writes the picture as `output` says, with its layers if the file can hold them. `name` is the picture's in
/// warnings. Returns what is known of it if it was denoised. Throws as write_image() and denoise_channels().
std::optional<DenoiseFigures> write_picture(const OutputOptions& output, const Image& image,
                                            const ChannelImage& layers,
                                            std::map<std::string, std::string> metadata,
                                            const std::string& name, int threads, bool quiet);

}  // namespace lightmill::client
