#include "client/write_picture.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/output.h"
#include "common/base/error.h"
#include "common/base/parse_number.h"
#include "common/image/color_channels.h"
#include "common/image/denoise/denoise.h"
#include "common/image/denoise/layers.h"
#include "common/job/replicates.h"

namespace lightmill::client {
namespace {

/// What there is no warning of is as it should be.
void warn_of_missing(const DenoiseLayers& layers, const std::string& name) {
  std::string missing;
  const auto add = [&](bool there, const char* layer) {
    if (!there) missing += (missing.empty() ? "" : ", ") + std::string(layer);
  };
  add(layers.has_albedo, "albedo");
  add(layers.has_normal, "normal");
  add(layers.has_depth, "depth");
  if (!missing.empty())
    print_warning(name + ": it has no layer " + missing + ": edges and textures may blur");
  if (!layers.has_difference) {
    print_warning(name +
                  ": it has no layer difference, so its noise is guessed from the picture; render with --aov "
                  "denoise to have it measured");
  }
}

void write_as(const OutputOptions& output, const Image& image, const ChannelImage& layers,
              std::map<std::string, std::string> metadata, const std::string& name, bool quiet) {
  const bool layered = is_exr(output.path);
  if (layered && output.space != ImageSpace::kRec709 && has_variance(layers.channels) && !quiet) {
    print_warning(name + ": the layer variance is left out of " + output.path +
                  ": squares of Rec.709's channels can't be converted to " + image_space_name(output.space));
  }
  write_image(
      image, output.path,
      {output.half, std::move(metadata), layered ? &layers : nullptr, output.transform, output.space});
}

}  // namespace

nlohmann::json denoise_to_json(const DenoiseFigures& figures) {
  nlohmann::json json = {
      {"difference", figures.difference}, {"relmse_raw", figures.relmse_raw}, {"relmse", figures.relmse}};
  json["relmse_low"] = figures.relmse_low ? nlohmann::json(*figures.relmse_low) : nlohmann::json(nullptr);
  json["relmse_high"] = figures.relmse_high ? nlohmann::json(*figures.relmse_high) : nlohmann::json(nullptr);
  return json;
}

std::string denoise_line(const DenoiseFigures& figures) {
  char text[128], interval[64] = "";
  if (figures.relmse_low && figures.relmse_high) {
    std::snprintf(interval, sizeof interval, " (95 %%: %.3g to %.3g)", *figures.relmse_low,
                  *figures.relmse_high);
  }
  std::snprintf(text, sizeof text, "estimated relMSE %.3g%s, before %.3g", figures.relmse, interval,
                figures.relmse_raw);
  return text;
}

DenoisedPicture denoise_channels(const ChannelImage& file, const std::string& name, const std::string& spp,
                                 int threads, bool interval, bool quiet) {
  const int64_t pixels = int64_t{file.image.width} * file.image.height;
  if (pixels > kMaxDenoisePixels) {
    throw Error(ErrorKind::kUsage, name + ": it has " + std::to_string(file.image.width) + "x" +
                                       std::to_string(file.image.height) + " pixels, and at most " +
                                       std::to_string(kMaxDenoisePixels) + " can be denoised");
  }
  DenoiseLayers layers = find_denoise_layers(file, name);
  if (!quiet) warn_of_missing(layers, name);
  double samples = kIndependentHalvesSpp;
  if (!spp.empty() && !parse_number(spp, &samples)) samples = 0;
  const bool found = layers.has_difference && samples >= kIndependentHalvesSpp;
  const DenoiseResult result =
      denoise_picture(std::move(layers.input),
                      {.threads = threads, .interval = found && (interval || pixels <= kMostIntervalPixels)});
  DenoisedPicture picture{
      Image(file.image.width, file.image.height),
      denoised_layers(file, layers, result),
      {layers.has_difference, result.relmse_raw, result.relmse, result.relmse_low, result.relmse_high}};
  for (size_t i = 0; i < picture.image.data.size(); ++i) picture.image.data[i] = result.colour[i % 3][i / 3];
  return picture;
}

void write_denoised(const OutputOptions& output, const DenoisedPicture& picture,
                    std::map<std::string, std::string> metadata, const std::string& name, bool quiet) {
  const auto put = [&](const char* key, const std::optional<double>& value) {
    char text[32];
    if (!value) return;
    std::snprintf(text, sizeof text, "%.9g", *value);
    metadata[key] = text;
  };
  put("denoised_relmse", picture.figures.relmse);
  put("denoised_relmse_low", picture.figures.relmse_low);
  put("denoised_relmse_high", picture.figures.relmse_high);
  write_as(output, picture.image, picture.layers, std::move(metadata), name, quiet);
}

std::optional<DenoiseFigures> write_picture(const OutputOptions& output, const Image& image,
                                            const ChannelImage& layers,
                                            std::map<std::string, std::string> metadata,
                                            const std::string& name, int threads, bool quiet) {
  if (!output.denoise) {
    write_as(output, image, layers, std::move(metadata), name, quiet);
    return std::nullopt;
  }
  const auto spp = metadata.find("spp");
  const DenoisedPicture clean = denoise_channels(
      as_channels(image, layers), name, spp == metadata.end() ? "" : spp->second, threads, false, quiet);
  write_denoised(output, clean, std::move(metadata), name, quiet);
  return clean.figures;
}

}  // namespace lightmill::client
