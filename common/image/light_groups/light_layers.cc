#include "common/image/light_groups/light_layers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "common/base/error.h"
#include "common/base/lower_case.h"
#include "common/job/light_groups.h"

namespace lightmill {

namespace {

constexpr std::string_view kOurPrefix = "lightgroup_", kOfDifference = "_difference";
constexpr std::string_view kOtherPrefixes[] = {"Combined_", "RGBA_", "C_"};
constexpr double kRestOfOurs = 0.01;  // share of the picture's light

constexpr std::string_view kComponents = "rgb";

/// Channels of a layer by component, as far as they are there.
struct LayerChannels {
  std::string view, name;  // "ViewLayer." and what stands after the prefix
  std::array<std::optional<size_t>, 3> found;
};

/// "Layer.R": "Layer" and "r".
std::pair<std::string, std::string> split_channel(const std::string& channel) {
  const size_t dot = channel.rfind('.');
  if (dot == std::string::npos) return {"", lower_case(channel)};
  return {channel.substr(0, dot), lower_case(channel.substr(dot + 1))};
}

/// Where the prefix begins: at the front, or after the dot of a view layer.
size_t find_prefix(const std::string& layer, std::string_view prefix) {
  for (size_t at = 0; at < layer.size();) {
    if (std::string_view(layer).substr(at).starts_with(prefix)) return at;
    const size_t dot = layer.find('.', at);
    if (dot == std::string::npos) break;
    at = dot + 1;
  }
  return std::string::npos;
}

std::vector<LayerChannels> layers_with(std::string_view prefix, const ChannelImage& file,
                                       const std::string& path) {
  std::vector<LayerChannels> layers;
  for (size_t i = 0; i < file.channels.size(); ++i) {
    const auto [layer, component] = split_channel(file.channels[i]);
    const size_t at = find_prefix(layer, prefix);
    if (at == std::string::npos || component.size() != 1) continue;
    const size_t c = kComponents.find(component);
    const std::string view = layer.substr(0, at), name = layer.substr(at + prefix.size());
    if (c == std::string::npos || name.empty()) continue;
    auto known = std::find_if(layers.begin(), layers.end(),
                              [&](const LayerChannels& l) { return l.name == name && l.view == view; });
    if (known == layers.end()) known = layers.insert(layers.end(), {view, name, {}});
    known->found[c] = i;
    if (view == layers.front().view) continue;
    throw Error(ErrorKind::kUsage, path + ": it has light groups of more than one view layer (" +
                                       file.channels[i] + "); save the image with one of them");
  }
  return layers;
}

RgbChannels all_three(const LayerChannels& layer, std::string_view prefix, const std::string& path) {
  RgbChannels channels{};
  for (size_t c = 0; c < 3; ++c) {
    if (!layer.found[c]) {
      throw Error(ErrorKind::kUsage, path + ": its layer " + layer.view + std::string(prefix) + layer.name +
                                         " has no channel " + "RGB"[c] +
                                         "; save the image with all three channels of each light group");
    }
    channels[c] = *layer.found[c];
  }
  return channels;
}

/// Upper and lower case are one.
std::optional<RgbChannels> find_rgb(const ChannelImage& file, const std::string& layer) {
  std::array<std::optional<size_t>, 3> found;
  for (size_t i = 0; i < file.channels.size(); ++i) {
    const auto [name, component] = split_channel(file.channels[i]);
    const size_t c = component.size() == 1 ? kComponents.find(component) : std::string::npos;
    if (c != std::string::npos && !found[c] && lower_case(name) == lower_case(layer)) found[c] = i;
  }
  if (!found[0] || !found[1] || !found[2]) return std::nullopt;
  return RgbChannels{*found[0], *found[1], *found[2]};
}

/// The first that is there is taken.
RgbChannels find_picture(const ChannelImage& file, const std::string& view, const std::string& path) {
  const std::string names[] = {"raw",         "",       view + "Combined", view + "RGBA",       view + "C",
                               view + "rgba", "beauty", "Image",           "Composite.Combined"};
  for (const std::string& name : names) {
    if (const auto found = find_rgb(file, name)) return *found;
  }
  throw Error(ErrorKind::kUsage, path + ": it has no colour beside its light groups: no channels R, G and B");
}

/// Whether Lightmill's groups lack light of the picture.
bool lacks_light(const ChannelImage& file, const LightLayers& lights) {
  const auto channels = static_cast<size_t>(file.image.channels);
  double lacks = 0, all = 0;
  for (size_t at = 0; at < file.image.data.size(); at += channels) {
    const float* pixel = &file.image.data[at];
    for (size_t c = 0; c < 3; ++c) {
      const double picture = pixel[lights.picture[c]];
      double sum = 0;
      for (const LightLayer& group : lights.groups) sum += static_cast<double>(pixel[group.colour[c]]);
      if (!std::isfinite(picture - sum)) continue;
      lacks += std::abs(picture - sum);
      all += std::abs(picture);
    }
  }
  return lacks > kRestOfOurs * all;
}

std::string free_name(const LightLayers& lights) {
  std::string name = kRestGroup;
  const auto taken = [&](const LightLayer& group) { return group.name == name; };
  while (std::any_of(lights.groups.begin(), lights.groups.end(), taken)) name += '_';
  return name;
}

}  // namespace

std::vector<std::string> LightLayers::names() const {
  std::vector<std::string> all;
  for (const LightLayer& group : groups) all.push_back(group.name);
  if (!rest.empty()) all.push_back(rest);
  return all;
}

LightLayers find_light_layers(const ChannelImage& file, const std::string& path) {
  std::string_view prefix = kOurPrefix;
  std::vector<LayerChannels> layers = layers_with(prefix, file, path);
  const bool ours = !layers.empty();
  for (const std::string_view other : kOtherPrefixes) {
    if (layers.empty()) layers = layers_with(prefix = other, file, path);
  }
  if (layers.empty()) {
    throw Error(ErrorKind::kUsage, path +
                                       ": it has no light groups; name groups in the scene and render it "
                                       "with --aov lightgroups to an .exr");
  }
  std::map<std::string, const LayerChannels*> by_name;
  for (const LayerChannels& layer : layers) by_name[layer.name] = &layer;
  LightLayers lights;
  for (const LayerChannels& layer : layers) {
    if (ours && layer.name.ends_with(kOfDifference) &&
        by_name.contains(layer.name.substr(0, layer.name.size() - kOfDifference.size()))) {
      continue;  // it is taken with its group
    }
    LightLayer group{layer.name, all_three(layer, prefix, path), {}};
    const auto difference = by_name.find(layer.name + std::string(kOfDifference));
    if (ours && difference != by_name.end()) group.difference = all_three(*difference->second, prefix, path);
    lights.groups.push_back(std::move(group));
  }
  std::ranges::stable_partition(lights.groups, [](const LightLayer& g) { return g.name != kRestGroup; });
  lights.picture = find_picture(file, layers.front().view, path);
  lights.difference = find_rgb(file, "difference");
  if (!ours || lacks_light(file, lights)) lights.rest = free_name(lights);
  return lights;
}

std::vector<LightShare> light_shares(const ChannelImage& file, const LightLayers& lights) {
  std::vector<LightShare> shares;
  for (const std::string& name : lights.names()) shares.push_back({name, {}, {}});
  const auto channels = static_cast<size_t>(file.image.channels);
  int64_t pixels = 0;
  std::vector<double> values(3 * shares.size());
  for (size_t at = 0; at < file.image.data.size(); at += channels) {
    const float* pixel = &file.image.data[at];
    double check = 0;  // NaN if any of the values is not finite
    for (size_t c = 0; c < 3; ++c) {
      double left = pixel[lights.picture[c]];
      for (size_t g = 0; g < lights.groups.size(); ++g) {
        const double value = pixel[lights.groups[g].colour[c]];
        left -= values[3 * g + c] = value;
      }
      if (!lights.rest.empty()) values[3 * lights.groups.size() + c] = left;
      check += 0 * left;
    }
    if (std::isnan(check)) continue;
    ++pixels;
    for (size_t i = 0; i < values.size(); ++i) shares[i / 3].mean[i % 3] += values[i];
  }
  double all = 0;
  const auto luminance = [](const LightShare& s) {  // of Rec.709
    return 0.2126 * s.mean[0] + 0.7152 * s.mean[1] + 0.0722 * s.mean[2];
  };
  for (LightShare& s : shares) {
    for (double& mean : s.mean) mean /= static_cast<double>(std::max<int64_t>(pixels, 1));
    all += luminance(s);
  }
  for (LightShare& s : shares) {
    if (all > 0) s.share = luminance(s) / all;
  }
  return shares;
}

}  // namespace lightmill
