// lightmill denoise: takes the noise out of a rendered image.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "client/cli.h"
#include "client/options.h"
#include "client/output.h"
#include "client/write_picture.h"
#include "common/base/error.h"
#include "common/image/image.h"

namespace lightmill::client {
namespace {

struct DenoiseVerbOptions {
  CommonOptions common;
  OutputOptions output;
  std::string image;
  int threads = 0;
  bool interval = false;
};

int denoise(DenoiseVerbOptions& options) {
  if (options.output.path.empty())
    throw Error(ErrorKind::kUsage, "-o is required; see lightmill denoise --help");
  finish_output_options(&options.output);
  keep_image_space(options.image, &options.output);
  check_output(options.output);
  const bool quiet = options.common.quiet;
  const ChannelImage file = read_channels(options.image, kMaxDenoisePixels);
  const std::string spp = read_image_metadata(options.image, "spp");
  const DenoisedPicture clean =
      denoise_channels(file, options.image, spp, options.threads, options.interval, quiet);
  std::map<std::string, std::string> metadata;
  if (!spp.empty()) metadata["spp"] = spp;  // it may be denoised once more
  write_denoised(options.output, clean, std::move(metadata), options.image, quiet);
  if (options.common.json) {
    nlohmann::json document = {
        {"output", options.output.path}, {"width", clean.image.width}, {"height", clean.image.height}};
    document.update(denoise_to_json(clean.figures));
    std::printf("%s\n", document.dump(2).c_str());
  } else if (!quiet) {
    std::fprintf(stderr, "%s\n", denoise_line(clean.figures).c_str());
  }
  return 0;
}

}  // namespace

void add_denoise(CLI::App& app, Action& action) {
  auto options = std::make_shared<DenoiseVerbOptions>();
  CLI::App* verb = add_verb(app, "denoise", "Take the noise out of a rendered image", &options->common);
  add_json(verb, &options->common);
  add_output(verb, &options->output);
  verb->get_option("--colorspace")->default_str("the image's");
  verb->add_option("--threads", options->threads, "Threads; 0: all processors")
      ->check(CLI::Range(0, 1024).description("0 to 1024"))
      ->capture_default_str();
  verb->add_flag(
      "--interval", options->interval,
      "Find the error's 95 % interval of more than a million pixels, too: takes as long once more");
  verb->add_option("IMAGE", options->image, "The .exr to denoise, best of render --aov denoise")->required();
  verb->callback([&action, options] { action = [options] { return denoise(*options); }; });
}

}  // namespace lightmill::client
