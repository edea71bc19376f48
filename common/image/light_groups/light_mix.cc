#include "common/image/light_groups/light_mix.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include "common/base/lower_case.h"

namespace lightmill {

namespace {

// What other lights do not change. What is not known is not kept: it may show light. Lower case, and without
// the name of a view layer.
constexpr std::string_view kKeptLayers[] = {"albedo",
                                            "albedo_difference",
                                            "normal",
                                            "normal_difference",
                                            "depth",
                                            "depth_difference",
                                            "position",
                                            "samples",
                                            "denoising albedo",
                                            "denoising normal",
                                            "denoising depth",
                                            "denoise_albedo",
                                            "denoise_normal",
                                            "diffuse_albedo",
                                            "diffcol",
                                            "glosscol",
                                            "transcol",
                                            "sh_normal",
                                            "normals",
                                            "n",
                                            "ns",
                                            "p",
                                            "z",
                                            "uv",
                                            "objectid",
                                            "materialid",
                                            "diffusealbedo",
                                            "specularalbedo",
                                            "motion",
                                            "mist",
                                            "vector",
                                            "motionvector",
                                            "indexob",
                                            "indexma",
                                            "id"};
constexpr std::string_view kKeptPrefix = "crypto";  // Cryptomatte
// The same of channels without a layer: coverage, depth, and those of pbrt's gbuffer.
constexpr std::string_view kKeptChannels[] = {"a", "z", "id", "u", "v", "dzdx", "dzdy"};

bool is_kept(const std::string& channel) {
  const std::string text = lower_case(channel);
  const size_t dot = text.rfind('.');
  if (dot == std::string::npos) return std::ranges::find(kKeptChannels, text) != std::end(kKeptChannels);
  std::string layer = text.substr(0, dot);
  if (const size_t view = layer.rfind('.'); view != std::string::npos) layer.erase(0, view + 1);
  return layer.starts_with(kKeptPrefix) || std::ranges::find(kKeptLayers, layer) != std::end(kKeptLayers);
}

/// What stands before the channel's last dot; the channel itself if there is none.
std::string layer_of(const std::string& channel) { return channel.substr(0, channel.rfind('.')); }

void check_factors(const LightLayers& lights, std::span<const LightFactor> factors) {
  if (factors.size() != lights.groups.size() + (lights.rest.empty() ? 0 : 1))
    throw std::invalid_argument("light mix: not one factor for each group");
}

/// Channels whose light stays as it is.
std::array<bool, 3> unchanged(std::span<const LightFactor> factors) {
  std::array<bool, 3> same{};
  for (size_t c = 0; c < 3; ++c)
    same[c] = std::ranges::all_of(factors, [c](const LightFactor& f) { return f[c] == 1; });
  return same;
}

/// Channels of one kind: of the radiance, or of the difference.
struct Terms {
  std::optional<RgbChannels> whole;  // needed where there is a rest
  std::vector<RgbChannels> groups;
};

Image mix(const ChannelImage& file, const Terms& terms, std::span<const LightFactor> factors) {
  const auto channels = static_cast<size_t>(file.image.channels);
  const std::array<bool, 3> same = unchanged(factors);
  const bool has_rest = factors.size() > terms.groups.size();
  Image mixed(file.image.width, file.image.height);
  float* to = mixed.data.data();
  for (size_t at = 0; at < file.image.data.size(); at += channels) {
    const float* pixel = &file.image.data[at];
    for (size_t c = 0; c < 3; ++c, ++to) {
      if (same[c] && terms.whole) {
        *to = pixel[(*terms.whole)[c]];
        continue;
      }
      double sum = 0, groups = 0;
      for (size_t g = 0; g < terms.groups.size(); ++g) {
        const double value = pixel[terms.groups[g][c]];
        groups += value;
        if (factors[g][c] != 0) sum += factors[g][c] * value;
      }
      if (has_rest && factors.back()[c] != 0)
        sum += factors.back()[c] * (static_cast<double>(pixel[(*terms.whole)[c]]) - groups);
      *to = static_cast<float>(sum);
    }
  }
  return mixed;
}

/// Nothing if the file lacks one that is needed.
std::optional<Terms> terms_of_difference(const LightLayers& lights, std::span<const LightFactor> factors) {
  const std::array<bool, 3> same = unchanged(factors);
  const bool only_whole = lights.difference && same[0] && same[1] && same[2];
  if (!lights.rest.empty() && !lights.difference) return std::nullopt;
  Terms terms{lights.difference, {}};
  for (const LightLayer& group : lights.groups) {
    if (!group.difference && !only_whole) return std::nullopt;
    terms.groups.push_back(group.difference.value_or(group.colour));
  }
  return terms;
}

/// What the layers of the mixed picture are made of.
struct Recipe {
  struct Channel {
    size_t from;
    float factor = 1;
  };
  std::vector<Channel> channels;
  std::vector<std::string> names;
  void add(size_t from, const std::string& name, double factor = 1) {
    channels.push_back({from, static_cast<float>(factor)});
    names.push_back(name);
  }
};

/// The factor of each channel that belongs to a group.
std::vector<std::optional<double>> channel_factors(const ChannelImage& file, const LightLayers& lights,
                                                   std::span<const LightFactor> factors) {
  std::vector<std::optional<double>> of(file.channels.size());
  for (size_t g = 0; g < lights.groups.size(); ++g) {
    const LightLayer& group = lights.groups[g];
    for (size_t c = 0; c < 3; ++c) {
      of[group.colour[c]] = factors[g][c];
      if (group.difference) of[(*group.difference)[c]] = factors[g][c];
    }
  }
  return of;
}

bool has(const RgbChannels& channels, size_t channel) {
  return std::ranges::find(channels, channel) != channels.end();
}

Recipe make_recipe(const ChannelImage& file, const LightLayers& lights, std::span<const LightFactor> factors,
                   std::vector<std::string>* left_out) {
  const std::vector<std::optional<double>> factor = channel_factors(file, lights, factors);
  const std::string alpha = lower_case(layer_of(file.channels[lights.picture[0]])) + ".a";
  std::vector<std::string> group_alphas;
  for (const LightLayer& group : lights.groups)
    group_alphas.push_back(lower_case(layer_of(file.channels[group.colour[0]])) + ".a");
  const bool has_alpha = std::ranges::find(file.channels, "A") != file.channels.end();
  Recipe recipe;
  for (size_t i = 0; i < file.channels.size(); ++i) {
    const std::string& name = file.channels[i];
    const std::string text = lower_case(name);
    if (factor[i]) {
      recipe.add(i, name, *factor[i]);
    } else if (has(lights.picture, i) || text == "r" || text == "g" || text == "b") {
      continue;  // the mixed colour is in its place,
    } else if (lights.difference && has(*lights.difference, i)) {
      continue;  // and the mixed difference, if there is one
    } else if (is_kept(name) || std::ranges::find(group_alphas, text) != group_alphas.end()) {
      recipe.add(i, name);
    } else if (text == alpha) {
      if (!has_alpha) recipe.add(i, "A");  // its colour becomes the unnamed layer
    } else if (const std::string layer = layer_of(name);
               std::ranges::find(*left_out, layer) == left_out->end()) {
      left_out->push_back(layer);
    }
  }
  return recipe;
}

}  // namespace

MixedColour mix_colour(const ChannelImage& file, const LightLayers& lights,
                       std::span<const LightFactor> factors) {
  check_factors(lights, factors);
  Terms terms{lights.picture, {}};
  for (const LightLayer& group : lights.groups) terms.groups.push_back(group.colour);
  MixedColour colour{mix(file, terms, factors), {}};
  if (const auto difference = terms_of_difference(lights, factors))
    colour.difference = mix(file, *difference, factors);
  return colour;
}

MixedLayers mix_layers(const ChannelImage& file, const LightLayers& lights,
                       std::span<const LightFactor> factors, const MixedColour& colour) {
  check_factors(lights, factors);
  MixedLayers mixed;
  const Recipe recipe = make_recipe(file, lights, factors, &mixed.left_out);
  ChannelImage& layers = mixed.layers;
  layers.attributes = file.attributes;
  layers.channels = recipe.names;
  if (colour.difference) {
    layers.channels.insert(layers.channels.end(), {"difference.R", "difference.G", "difference.B"});
  } else if (lights.difference) {
    mixed.left_out.emplace_back("difference");
  }
  const auto channels = static_cast<size_t>(file.image.channels);
  layers.image = Image(file.image.width, file.image.height, static_cast<int>(layers.channels.size()));
  float* to = layers.image.data.data();
  for (size_t i = 0; i < colour.image.data.size() / 3; ++i) {
    const float* pixel = &file.image.data[i * channels];
    for (const Recipe::Channel& channel : recipe.channels)
      *to++ = channel.factor == 0 ? 0 : channel.factor * pixel[channel.from];
    if (colour.difference) to = std::copy_n(&colour.difference->data[3 * i], 3, to);
  }
  return mixed;
}

}  // namespace lightmill
