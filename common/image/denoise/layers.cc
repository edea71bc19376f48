#include "common/image/denoise/layers.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "common/base/error.h"
#include "common/base/lower_case.h"

namespace lightmill {

namespace {

constexpr const char kRawLayer[] = "raw", kErrorLayer[] = "error";

// The first that is there is taken.
constexpr const char* kColourNames[] = {kRawLayer, "noisy image", "", "combined", "beauty", "rgba", "image"};
constexpr const char* kAlbedoNames[] = {"albedo", "denoising albedo", "denoise_albedo", "diffuse_albedo",
                                        "diffcol"};
constexpr const char* kNormalNames[] = {"normal", "ns",        "denoising normal", "denoise_normal",
                                        "n",      "sh_normal", "normals"};
constexpr const char* kDepthNames[] = {"depth", "denoising depth", "z", ""};

/// "ViewLayer.Denoising Albedo.R": layer "denoising albedo", component "r".
struct ChannelName {
  std::string layer, component;
  explicit ChannelName(const std::string& name) {
    const std::string text = lower_case(name);
    const size_t dot = text.rfind('.');
    component = dot == std::string::npos ? text : text.substr(dot + 1);
    if (dot == std::string::npos) return;
    layer = text.substr(0, dot);
    if (const size_t view = layer.rfind('.'); view != std::string::npos) layer.erase(0, view + 1);
  }
};

class ChannelTable {
 public:
  explicit ChannelTable(const ChannelImage& file) : file_(file) {
    for (const std::string& name : file.channels) names_.emplace_back(name);
  }
  std::optional<size_t> find(const std::string& layer, const std::string& components) const {
    for (size_t i = 0; i < names_.size(); ++i) {
      if (names_[i].layer == layer && names_[i].component.size() == 1 &&
          components.find(names_[i].component) != std::string::npos) {
        return i;
      }
    }
    return std::nullopt;
  }
  /// All three channels of a layer, red or x first.
  bool find_three(const std::string& layer, std::array<size_t, 3>* channels) const {
    for (const char* letters : {"rgb", "xyz"}) {
      size_t found = 0;
      for (size_t c = 0; c < 3; ++c) {
        const auto at = find(layer, std::string(1, letters[c]));
        if (!at) break;
        (*channels)[c] = *at, ++found;
      }
      if (found == 3) return true;
    }
    return false;
  }
  std::vector<float> plane(size_t channel) const {
    const auto channels = static_cast<size_t>(file_.image.channels);
    std::vector<float> values(file_.image.data.size() / channels);
    for (size_t i = 0; i < values.size(); ++i) values[i] = file_.image.data[i * channels + channel];
    return values;
  }

 private:
  const ChannelImage& file_;
  std::vector<ChannelName> names_;
};

/// The first of the names that has three channels.
std::optional<std::string> find_layer(const ChannelTable& table, std::span<const char* const> names,
                                      std::array<size_t, 3>* channels) {
  for (const char* name : names) {
    if (table.find_three(name, channels)) return name;
  }
  return std::nullopt;
}

bool take_feature(const ChannelTable& table, std::span<const char* const> names,
                  std::array<DenoiseInput::Feature, 3>* feature, std::string* name) {
  std::array<size_t, 3> channels{}, difference{};
  const auto layer = find_layer(table, names, &channels);
  if (!layer) return false;
  *name = *layer;
  const bool known = table.find_three(*layer + "_difference", &difference);
  for (size_t c = 0; c < 3; ++c) {
    (*feature)[c].values = table.plane(channels[c]);
    if (known) (*feature)[c].difference = table.plane(difference[c]);
  }
  return true;
}

}  // namespace

ChannelImage as_channels(const Image& image, const ChannelImage& layers) {
  const auto beside = static_cast<size_t>(layers.image.data.empty() ? 0 : layers.image.channels);
  ChannelImage all{
      Image(image.width, image.height, 3 + static_cast<int>(beside)), {"R", "G", "B"}, layers.attributes};
  all.channels.insert(all.channels.end(), layers.channels.begin(), layers.channels.end());
  float* to = all.image.data.data();
  for (size_t i = 0; i < image.data.size() / 3; ++i) {
    to = std::copy_n(&image.data[3 * i], 3, to);
    if (beside > 0) to = std::copy_n(&layers.image.data[beside * i], beside, to);
  }
  return all;
}

DenoiseLayers find_denoise_layers(const ChannelImage& file, const std::string& path) {
  const ChannelTable table(file);
  DenoiseLayers layers;
  DenoiseInput& input = layers.input;
  input.width = file.image.width, input.height = file.image.height;
  std::array<size_t, 3> channels{};
  const auto colour = find_layer(table, kColourNames, &channels);
  if (!colour) {
    throw Error(ErrorKind::kUsage, path + ": it has no colour to denoise: no channels R, G and B");
  }
  layers.colour = *colour;
  for (size_t c = 0; c < 3; ++c) input.colour[c] = table.plane(channels[c]);
  layers.has_albedo = take_feature(table, kAlbedoNames, &input.albedo, &layers.albedo);
  layers.has_normal = take_feature(table, kNormalNames, &input.normal, &layers.normal);
  for (const char* name : kDepthNames) {
    // The unnamed layer has others of one letter, too.
    const auto channel = table.find(name, *name ? "zvydr" : "z");
    if (!channel) continue;
    layers.has_depth = true;
    layers.depth = name;
    input.depth.values = table.plane(*channel);
    if (const auto d = table.find(std::string(name) + "_difference", "zvydr"))
      input.depth.difference = table.plane(*d);
    break;
  }
  if (table.find_three("difference", &channels)) {
    layers.has_difference = true;
    for (size_t c = 0; c < 3; ++c) input.difference[c] = table.plane(channels[c]);
  }
  return layers;
}

ChannelImage denoised_layers(const ChannelImage& file, const DenoiseLayers& layers,
                             const DenoiseResult& result) {
  ChannelImage out;
  std::vector<size_t> kept, raw;
  for (size_t i = 0; i < file.channels.size(); ++i) {
    const ChannelName name(file.channels[i]);
    const bool colour =
        name.layer == layers.colour && name.component.find_first_not_of("rgb") == std::string::npos;
    if (colour) raw.push_back(i);
    const bool replaced = name.layer.empty() && name.component.find_first_not_of("rgb") == std::string::npos;
    if (!replaced && name.layer != kRawLayer && name.layer != kErrorLayer) kept.push_back(i);
  }
  out.attributes = file.attributes;
  out.channels = {"raw.R", "raw.G", "raw.B", "error.V"};
  for (const size_t i : kept) out.channels.push_back(file.channels[i]);
  out.image = Image(file.image.width, file.image.height, static_cast<int>(out.channels.size()));
  std::array<size_t, 3> from{};
  for (const size_t i : raw) from[std::string("rgb").find(ChannelName(file.channels[i]).component)] = i;
  const auto channels = static_cast<size_t>(file.image.channels);
  for (size_t i = 0; i < result.squared_error.size(); ++i) {
    const float* pixel = &file.image.data[i * channels];
    float* to = &out.image.data[i * out.channels.size()];
    for (const size_t c : from) *to++ = pixel[c];
    *to++ = std::sqrt(std::max(0.0f, result.squared_error[i]));
    for (const size_t c : kept) *to++ = pixel[c];
  }
  return out;
}

}  // namespace lightmill
