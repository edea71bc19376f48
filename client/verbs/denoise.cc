// lightmill denoise: takes the noise out of a rendered image.
#include "common/image/denoise/denoise.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/options.h"
#include "client/output.h"
#include "common/base/error.h"
#include "common/image/denoise/layers.h"
#include "common/image/image.h"

namespace lightmill::client {
namespace {

/// Of larger images the layers and what is made of them take more memory than most machines have.
constexpr int64_t kMaxDenoisePixels = int64_t{1} << 26;

struct DenoiseVerbOptions {
  CommonOptions common;
  OutputOptions output;
  std::string image;
  int threads = 0;
};

/// What there is no warning of is as it should be.
void warn_of_missing(const DenoiseLayers& layers, const std::string& path) {
  std::string missing;
  const auto add = [&](bool there, const char* name) {
    if (!there) missing += (missing.empty() ? "" : ", ") + std::string(name);
  };
  add(layers.has_albedo, "albedo");
  add(layers.has_normal, "normal");
  add(layers.has_depth, "depth");
  if (!missing.empty())
    print_warning(path + ": it has no layer " + missing + ": edges and textures may blur");
  if (!layers.has_difference) {
    print_warning(path +
                  ": it has no layer difference, so its noise is guessed from the picture; render with --aov "
                  "denoise to have it measured");
  }
}

int denoise(const DenoiseVerbOptions& options) {
  if (options.output.path.empty())
    throw Error(ErrorKind::kUsage, "-o is required; see lightmill denoise --help");
  check_output(options.output);
  const ChannelImage file = read_channels(options.image, kMaxDenoisePixels);
  DenoiseLayers layers = find_denoise_layers(file, options.image);
  if (!options.common.quiet) warn_of_missing(layers, options.image);
  const DenoiseResult result = denoise_picture(std::move(layers.input), {options.threads});

  Image image(file.image.width, file.image.height);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = result.colour[i % 3][i / 3];
  ImageWriteOptions write;
  write.half = options.output.half;
  write.view = view_of(options.output);
  ChannelImage beside;
  if (is_exr(options.output.path)) {
    beside = denoised_layers(file, layers, result);
    write.layers = &beside;
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", result.relmse);
    write.metadata["denoised_relmse"] = text;
  }
  write_image(image, options.output.path, write);

  if (options.common.json) {
    const nlohmann::json document = {{"output", options.output.path},   {"width", image.width},
                                     {"height", image.height},          {"difference", layers.has_difference},
                                     {"relmse_raw", result.relmse_raw}, {"relmse", result.relmse}};
    std::printf("%s\n", document.dump(2).c_str());
  } else if (!options.common.quiet) {
    std::fprintf(stderr, "estimated relMSE %.3g, before %.3g\n", result.relmse, result.relmse_raw);
  }
  return 0;
}

}  // namespace

void add_denoise(CLI::App& app, Action& action) {
  auto options = std::make_shared<DenoiseVerbOptions>();
  CLI::App* verb = add_verb(app, "denoise", "Take the noise out of a rendered image", &options->common);
  add_json(verb, &options->common);
  add_output(verb, &options->output);
  verb->add_option("--threads", options->threads, "Threads; 0: all processors")
      ->check(CLI::Range(0, 1024).description("0 to 1024"))
      ->capture_default_str();
  verb->add_option("IMAGE", options->image, "The .exr to denoise, best of render --aov denoise")->required();
  verb->callback([&action, options] { action = [options] { return denoise(*options); }; });
}

}  // namespace lightmill::client
