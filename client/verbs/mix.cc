// lightmill mix: relights an image from its light groups, without rendering it again.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "client/cli.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "client/write_picture.h"
#include "common/base/error.h"
#include "common/error/halves_error.h"
#include "common/image/image_reader.h"
#include "common/image/light_groups/light_factor.h"
#include "common/image/light_groups/light_mix.h"

namespace lightmill::client {
namespace {

struct MixVerbOptions {
  CommonOptions common;
  OutputOptions output;
  std::string image;
  std::vector<std::string> factors;  // NAME=FACTOR
  int threads = 0;
};

// What stays true of an image in another light. Its error does not.
constexpr const char* kKeptMetadata[] = {"scene", "settings", "integrator", "plan",        "build",
                                         "job",   "spp",      "nonfinite",  "cpu_seconds", "wall_seconds"};
constexpr char kMixKey[] = "light_mix", kMixErrorKey[] = "mixed_relmse";

std::string with_commas(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// "key=1.5" or "key=0.2,0.3,0.4": the name and what is after it.
LightFactor parse_light_factor(const std::string& argument, std::string* name) {
  const auto complain = [&] {
    throw Error(ErrorKind::kUsage, argument +
                                       ": expected NAME=FACTOR with a number from 0 to 1e9, or three with "
                                       "commas between for red, green and blue, as key=1.5 or key=1,0.9,0.8");
  };
  const size_t equals = argument.rfind('=');
  if (equals == std::string::npos || equals == 0) complain();
  *name = argument.substr(0, equals);
  const auto factor = light_factor_of_text(std::string_view(argument).substr(equals + 1), ',');
  if (!factor) complain();
  return *factor;
}

/// One for each of `names`, 1 where none is given.
std::vector<LightFactor> parse_light_factors(const MixVerbOptions& options,
                                             const std::vector<std::string>& names) {
  std::vector<LightFactor> factors(names.size(), LightFactor{1, 1, 1});
  std::vector<bool> given(names.size());
  for (const std::string& argument : options.factors) {
    std::string name;
    const LightFactor factor = parse_light_factor(argument, &name);
    const auto at = static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    if (at == names.size()) {
      throw Error(ErrorKind::kUsage,
                  options.image + ": it has no light group \"" + name + "\"; it has " + with_commas(names));
    }
    if (given[at])
      throw Error(ErrorKind::kUsage, argument + ": light group \"" + name + "\" has a factor already");
    factors[at] = factor;
    given[at] = true;
  }
  return factors;
}

int list_lights(const MixVerbOptions& options, const ChannelImage& file, const LightLayers& lights) {
  const std::vector<LightShare> shares = light_shares(file, lights);
  if (options.common.json) {
    nlohmann::json groups = nlohmann::json::array();
    for (const LightShare& s : shares) {
      groups.push_back({{"name", s.name},
                        {"share", s.share ? nlohmann::json(*s.share) : nlohmann::json(nullptr)},
                        {"mean", s.mean}});
    }
    const nlohmann::json document = {{"image", options.image},
                                     {"width", file.image.width},
                                     {"height", file.image.height},
                                     {"groups", std::move(groups)}};
    std::printf("%s\n", dump(document).c_str());
    return 0;
  }
  std::printf("%8s  %-32s  %s\n", "SHARE", "MEAN RADIANCE (R G B)", "GROUP");
  for (const LightShare& s : shares) {
    char share[32] = "-", mean[64];
    if (s.share) std::snprintf(share, sizeof share, "%.2f %%", 100 * *s.share);
    std::snprintf(mean, sizeof mean, "%.4g %.4g %.4g", s.mean[0], s.mean[1], s.mean[2]);
    std::printf("%8s  %-32s  %s\n", share, mean, s.name.c_str());
  }
  return 0;
}

std::map<std::string, std::string> mixed_metadata(const MixVerbOptions& options) {
  std::map<std::string, std::string> metadata;
  std::string why;
  const auto reader = ImageReader::open({options.image}, &why);
  if (!reader) return metadata;
  const auto text = [&](const char* key) { return reader->attribute(std::string("lightmill:") + key); };
  for (const char* key : kKeptMetadata) {
    if (const std::string value = text(key); !value.empty()) metadata[key] = value;
  }
  // Of an image that was mixed before, both mixes.
  std::string mixes = text(kMixKey);
  for (const std::string& factor : options.factors) mixes += (mixes.empty() ? "" : " ") + factor;
  if (!mixes.empty()) metadata[kMixKey] = mixes;
  return metadata;
}

struct MixErrors {
  std::optional<double> before, after;  // estimates of relMSE
  std::string unknown;                  // why there is none
};

/// Of the image as it was rendered, and as it is mixed.
MixErrors mix_errors(const ChannelImage& file, const LightLayers& lights, const MixedColour& mixed) {
  if (!mixed.difference) {
    return {{},
            {},
            "no estimate of the error: the image has no layer difference of each light group; render it with "
            "--aov lightgroups,difference"};
  }
  const std::vector<LightFactor> ones(lights.names().size(), LightFactor{1, 1, 1});
  const MixedColour before = mix_colour(file, lights, ones);
  const std::vector<float>& values = before.difference->data;
  if (std::all_of(values.begin(), values.end(), [](float x) { return x == 0; })) {
    return {
        {}, {}, "no estimate of the error: the layer difference is 0 everywhere, as with 1 sample per pixel"};
  }
  return {relmse_of_halves(before.image, *before.difference),
          relmse_of_halves(mixed.image, *mixed.difference),
          {}};
}

void warn_of_mix(const MixVerbOptions& options, const Image& image,
                 const std::vector<std::string>& left_out) {
  size_t bad = 0;
  for (size_t i = 0; i < image.data.size(); i += 3) {
    bad += !(std::isfinite(image.data[i]) && std::isfinite(image.data[i + 1]) &&
             std::isfinite(image.data[i + 2]));
  }
  if (bad > 0) {
    print_warning(options.image + ": " + std::to_string(bad) +
                  " pixels are NaN or infinite in the mixed light, too; --denoise fills them");
  }
  if (!left_out.empty() && is_exr(options.output.path)) {
    print_warning(options.image +
                  ": layers left out, as they may not be true in another light: " + with_commas(left_out));
  }
}

void print_errors(const MixErrors& errors) {
  if (!errors.after) {
    std::fprintf(stderr, "%s\n", errors.unknown.c_str());
    return;
  }
  std::fprintf(stderr, "estimated relMSE %.3g, before %.3g\n", *errors.after, *errors.before);
}

nlohmann::json mix_to_json(const MixVerbOptions& options, const Image& image,
                           const std::vector<std::string>& names, const std::vector<LightFactor>& factors,
                           const MixErrors& errors, const std::vector<std::string>& left_out) {
  const auto number = [](const std::optional<double>& x) {
    return x ? nlohmann::json(*x) : nlohmann::json(nullptr);
  };
  nlohmann::json groups = nlohmann::json::array();
  for (size_t g = 0; g < names.size(); ++g) groups.push_back({{"name", names[g]}, {"factor", factors[g]}});
  return {{"output", options.output.path},         {"width", image.width}, {"height", image.height},
          {"groups", std::move(groups)},           {"left_out", left_out}, {"relmse", number(errors.after)},
          {"relmse_before", number(errors.before)}};
}

int mix_image(MixVerbOptions& options) {
  OutputOptions& output = options.output;
  const bool only_list = output.path.empty() && options.factors.empty() && !output.denoise;
  if (output.path.empty() && !only_list)
    throw Error(ErrorKind::kUsage, "-o is required; see lightmill mix --help");
  if (!only_list) {
    finish_output_options(&output);
    keep_image_space(options.image, &output);
    check_output(output);
  }
  ChannelImage file = read_channels(options.image, kMaxDenoisePixels);
  const LightLayers lights = find_light_layers(file, options.image);
  if (only_list) return list_lights(options, file, lights);
  const std::vector<std::string> names = lights.names();
  const std::vector<LightFactor> factors = parse_light_factors(options, names);
  std::map<std::string, std::string> metadata = mixed_metadata(options);

  const MixedColour colour = mix_colour(file, lights, factors);
  const MixedLayers beside = mix_layers(file, lights, factors, colour);
  const MixErrors errors = mix_errors(file, lights, colour);
  file = {};  // denoising takes memory, too
  if (errors.after) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", *errors.after);
    metadata[kMixErrorKey] = text;
  }
  const bool quiet = options.common.quiet;
  if (!quiet) warn_of_mix(options, colour.image, beside.left_out);
  const std::optional<DenoiseFigures> denoised = write_picture(
      output, colour.image, beside.layers, std::move(metadata), options.image, options.threads, quiet);
  if (options.common.json) {
    nlohmann::json document = mix_to_json(options, colour.image, names, factors, errors, beside.left_out);
    if (denoised) document["denoised"] = denoise_to_json(*denoised);
    std::printf("%s\n", dump(std::move(document)).c_str());
  } else if (!quiet) {
    print_errors(errors);
    if (denoised) std::fprintf(stderr, "denoised: %s\n", denoise_line(*denoised).c_str());
  }
  return 0;
}

}  // namespace

void add_mix(CLI::App& app, Action& action) {
  auto options = std::make_shared<MixVerbOptions>();
  CLI::App* verb =
      add_verb(app, "mix", "Relight an image from its light groups, or list these", &options->common);
  add_json(verb, &options->common);
  add_output(verb, &options->output);
  verb->get_option("--colorspace")->default_str("the image's");
  add_denoise_flag(verb, &options->output);
  verb->add_option("--threads", options->threads, "Threads of --denoise; 0: all processors")
      ->check(CLI::Range(0, 1024).description("0 to 1024"))
      ->capture_default_str();
  verb->add_option("IMAGE", options->image, "An .exr with light groups, of render --aov lightgroups")
      ->required();
  verb->add_option("FACTORS", options->factors,
                   "What the light of a group is multiplied by: NAME=FACTOR or NAME=R,G,B; without any, and "
                   "without -o, the groups are listed");
  verb->callback([&action, options] { action = [options] { return mix_image(*options); }; });
}

}  // namespace lightmill::client
