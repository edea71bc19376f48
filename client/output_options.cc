// The options of what is written, and the views and colour spaces that they name.
#include <CLI/CLI.hpp>
#include <cstdlib>

#include "client/options.h"
#include "common/base/error.h"
#include "common/image/color_config.h"

namespace lightmill::client {
namespace {

constexpr const char kOwnViews[] = "srgb, filmic, aces and none";

/// Reads the configuration of --ocio or of $OCIO; nothing if neither names one.
std::optional<ColorConfig> named_config(const std::string& option) {
  if (!option.empty()) return ColorConfig(option);
  const char* const variable = std::getenv("OCIO");
  if (!variable || !*variable) return std::nullopt;
  try {
    return ColorConfig(variable);
  } catch (const Error& e) {
    throw Error(e.kind(), std::string(e.what()) + "; $OCIO names it: correct that, or unset it");
  }
}

/// The configuration's come first: who names one means them.
ViewTransform view_named(const std::string& name, const std::string& ocio) {
  ViewTransform view;
  const auto config = named_config(ocio);
  if (config) view.of_config = config->find_view(name);
  if (view.of_config) return view;
  const auto curve = find_view_curve(name);
  if (curve) {
    view.curve = *curve;
    return view;
  }
  if (!config) {
    throw Error(ErrorKind::kUsage, "--view " + name + ": there is " + kOwnViews +
                                       "; those of an OpenColorIO configuration need --ocio FILE");
  }
  throw Error(ErrorKind::kUsage, "--view " + name + ": there is " + kOwnViews +
                                     ", and of the configuration: " + config->view_list());
}

}  // namespace

void add_output(CLI::App* verb, OutputOptions* output) {
  verb->add_option("-o,--output", output->path, "Image to write: .exr, .png, .hdr or .pfm");
  verb->add_flag("--half", output->half, "Write 16-bit floats (.exr only)");
  verb->add_option("--colorspace", output->colorspace, "Linear colours of an .exr, as its header says")
      ->check(CLI::IsMember(image_space_names()))
      ->default_str("rec709");
  // The choices are for help and completion; a configuration has others.
  verb->add_option("--view", output->view,
                   "Tone curve of a .png: srgb (clips at 1), filmic, aces, or none; with --ocio also VIEW or "
                   "DISPLAY/VIEW of its file")
      ->check(CLI::Validator([](std::string&) { return std::string(); }, "{srgb,filmic,aces,none}"))
      ->default_str("srgb");
  verb->add_option("--ocio", output->ocio,
                   "OpenColorIO configuration that --view takes views of (default: $OCIO)");
  verb->add_option("--exposure", output->exposure, "Stops that a .png is brightened by; may be negative")
      ->check(CLI::Range(-100.0, 100.0).description("-100 to 100"))
      ->capture_default_str();
}

void add_denoise_flag(CLI::App* verb, OutputOptions* output) {
  verb->add_flag(
      "--denoise", output->denoise,
      "Take the noise out of the image that is written; an .exr keeps the raw one as the layer raw");
}

void finish_output_options(OutputOptions* output) {
  if (!output->colorspace.empty()) output->space = image_space_named(output->colorspace);
  if (output->view) {
    output->transform = view_named(*output->view, output->ocio);
  } else if (!output->ocio.empty()) {
    throw Error(ErrorKind::kUsage, "--ocio " + output->ocio + ": name one of its views by --view: " +
                                       ColorConfig(output->ocio).view_list());
  }
  output->transform.exposure = output->exposure;
}

}  // namespace lightmill::client
