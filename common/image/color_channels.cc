#include "common/image/color_channels.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string_view>

#include "common/base/lower_case.h"

namespace lightmill {

namespace {

/// "ViewLayer.Denoising Albedo.R": whole "viewlayer.denoising albedo", name "denoising albedo", component
/// "r".
struct ChannelPath {
  std::string whole, name, component;
  explicit ChannelPath(const std::string& channel) {
    const std::string text = lower_case(channel);
    const size_t dot = text.rfind('.');
    component = dot == std::string::npos ? text : text.substr(dot + 1);
    if (dot != std::string::npos) whole = text.substr(0, dot);
    name = whole.substr(whole.rfind('.') == std::string::npos ? 0 : whole.rfind('.') + 1);
  }
};

// Layers that some renderers give the channels R, G and B though they hold no colours.
constexpr const char* kOtherLayers[] = {"normal",   "normals", "n",   "ns",     "ng",     "sh_normal",
                                        "position", "p",       "pos", "pworld", "vector", "motion",
                                        "velocity", "uv",      "st",  "depth",  "z",      "samples",
                                        "variance", "error",   "id"};

bool is_color_layer(std::string name) {
  constexpr std::string_view kHalves = "_difference";
  if (name.ends_with(kHalves)) name.resize(name.size() - kHalves.size());
  if (name.starts_with("crypto") || name.ends_with("normal")) return false;
  return std::find(std::begin(kOtherLayers), std::end(kOtherLayers), name) == std::end(kOtherLayers);
}

bool is_variance(const std::string& channel) { return ChannelPath(channel).name == "variance"; }

/// Indices of red, green and blue of every layer that has the three.
std::vector<std::array<size_t, 3>> color_triples(const std::vector<std::string>& channels) {
  constexpr size_t kNone = SIZE_MAX;
  std::map<std::string, std::array<size_t, 3>> layers;
  for (size_t i = 0; i < channels.size(); ++i) {
    const ChannelPath path(channels[i]);
    const size_t letter = path.component.size() == 1 ? std::string_view("rgb").find(path.component) : 3;
    if (letter < 3 && is_color_layer(path.name))
      layers.try_emplace(path.whole, std::array{kNone, kNone, kNone}).first->second[letter] = i;
  }
  std::vector<std::array<size_t, 3>> triples;
  for (const auto& [whole, triple] : layers) {
    if (std::find(triple.begin(), triple.end(), kNone) == triple.end()) triples.push_back(triple);
  }
  return triples;
}

void drop_variance(ChannelImage* image) {
  std::vector<size_t> kept;
  for (size_t i = 0; i < image->channels.size(); ++i) {
    if (!is_variance(image->channels[i])) kept.push_back(i);
  }
  const size_t before = image->channels.size(), after = kept.size();
  if (after == before) return;
  // In place: no value moves to where one that is still to be moved lies.
  std::vector<float>& data = image->image.data;
  for (size_t from = 0, to = 0; from < data.size(); from += before, to += after) {
    for (size_t c = 0; c < after; ++c) data[to + c] = data[from + kept[c]];
  }
  data.resize(data.size() / before * after);
  std::erase_if(image->channels, is_variance);
  image->image.channels = static_cast<int>(after);
}

}  // namespace

bool has_variance(const std::vector<std::string>& channels) {
  return std::any_of(channels.begin(), channels.end(), is_variance);
}

void convert_colors(ChannelImage* image, const RgbMatrix& m) {
  drop_variance(image);
  const auto triples = color_triples(image->channels);
  std::vector<float>& data = image->image.data;
  for (size_t at = 0; at < data.size(); at += image->channels.size()) {
    for (const auto& [r, g, b] : triples) {
      float rgb[] = {data[at + r], data[at + g], data[at + b]};
      convert_color(m, rgb);
      data[at + r] = rgb[0], data[at + g] = rgb[1], data[at + b] = rgb[2];
    }
  }
}

}  // namespace lightmill
