// Light groups in files of several programs, and what a mix makes of them.
#include "common/image/light_groups/light_mix.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/base/error.h"

namespace lightmill {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pointwise;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Appends the three channels of a layer, of the same value in all pixels.
void add_layer(const std::string& name, std::array<float, 3> colour, ChannelImage* file) {
  const auto before = static_cast<size_t>(file->image.channels);
  Image wider(file->image.width, file->image.height, file->image.channels + 3);
  const auto pixels = static_cast<size_t>(wider.width * wider.height);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < before; ++c) wider.data[i * (before + 3) + c] = file->image.data[i * before + c];
    for (size_t c = 0; c < 3; ++c) wider.data[i * (before + 3) + before + c] = colour[c];
  }
  file->image = std::move(wider);
  for (const char c : {'R', 'G', 'B'}) file->channels.push_back((name.empty() ? "" : name + ".") + c);
}

ChannelImage empty_file(int width, int height) { return {Image(width, height, 0), {}}; }

/// key 1,2,3, fill 4,5,6, rest 0.5; with their differences.
ChannelImage our_file(int width = 2, int height = 1) {
  ChannelImage file = empty_file(width, height);
  add_layer("", {5.5f, 7.5f, 9.5f}, &file);
  add_layer("lightgroup_key", {1, 2, 3}, &file);
  add_layer("lightgroup_fill", {4, 5, 6}, &file);
  add_layer("lightgroup_rest", {0.5f, 0.5f, 0.5f}, &file);
  add_layer("difference", {0.75f, 0.75f, 0.75f}, &file);
  add_layer("lightgroup_key_difference", {0.25f, 0.25f, 0.25f}, &file);
  add_layer("lightgroup_fill_difference", {0.5f, 0.5f, 0.5f}, &file);
  add_layer("lightgroup_rest_difference", {0, 0, 0}, &file);
  return file;
}

float& value(ChannelImage& file, const std::string& channel, size_t pixel = 0) {
  const auto at = std::find(file.channels.begin(), file.channels.end(), channel) - file.channels.begin();
  return file.image.data[pixel * file.channels.size() + static_cast<size_t>(at)];
}

std::string error_of(const ChannelImage& file) {
  try {
    find_light_layers(file, "a.exr");
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage);
    return e.what();
  }
  return "none";
}

TEST(LightLayers, OursHaveNamesAndDifferences) {
  const LightLayers lights = find_light_layers(our_file(), "a.exr");
  EXPECT_THAT(lights.names(), ElementsAre("key", "fill", "rest"));
  EXPECT_EQ(lights.rest, "");
  EXPECT_THAT(lights.groups[1].colour, ElementsAre(6, 7, 8));
  EXPECT_THAT(lights.groups[1].difference.value(), ElementsAre(18, 19, 20));
  EXPECT_THAT(lights.difference.value(), ElementsAre(12, 13, 14));
}

TEST(LightLayers, ThoseOfOtherProgramsLeaveARest) {
  for (const std::string layer : {"Combined_", "RGBA_", "C_", "ViewLayer.Combined_"}) {
    ChannelImage file = empty_file(1, 1);
    add_layer("", {5, 5, 5}, &file);
    add_layer(layer + "Key.001", {1, 2, 3}, &file);
    const LightLayers lights = find_light_layers(file, "a.exr");
    EXPECT_THAT(lights.names(), ElementsAre("Key.001", "rest")) << layer;
    const std::vector<LightFactor> factors = {{2, 2, 2}, {0, 1, 3}};
    const MixedColour colour = mix_colour(file, lights, factors);
    EXPECT_THAT(colour.image.data, ElementsAre(2, 7, 12)) << layer;
    EXPECT_FALSE(colour.difference);
  }
}

TEST(LightLayers, BlendersPictureIsThatOfTheViewLayer) {
  ChannelImage file = empty_file(1, 1);
  add_layer("ViewLayer.Combined", {5, 6, 7}, &file);
  file.channels.back() = "ViewLayer.Combined.B";
  add_layer("ViewLayer.Combined_key", {1, 2, 3}, &file);
  add_layer("ViewLayer.DiffDir", {1, 1, 1}, &file);
  add_layer("ViewLayer.Denoising Albedo", {1, 1, 1}, &file);
  const LightLayers lights = find_light_layers(file, "a.exr");
  EXPECT_THAT(lights.picture, ElementsAre(0, 1, 2));
  const std::vector<LightFactor> factors = {{2, 2, 2}, {1, 1, 1}};
  const MixedColour colour = mix_colour(file, lights, factors);
  EXPECT_THAT(colour.image.data, ElementsAre(6, 8, 10));
  const MixedLayers beside = mix_layers(file, lights, factors, colour);
  EXPECT_THAT(beside.layers.channels,
              ElementsAre("ViewLayer.Combined_key.R", "ViewLayer.Combined_key.G", "ViewLayer.Combined_key.B",
                          "ViewLayer.Denoising Albedo.R", "ViewLayer.Denoising Albedo.G",
                          "ViewLayer.Denoising Albedo.B"));
  EXPECT_THAT(beside.left_out, ElementsAre("ViewLayer.DiffDir"));
}

TEST(LightLayers, OursLeaveARestOnlyWhereLightLacks) {
  ChannelImage file = our_file();
  value(file, "R") *= 1.001f;  // as half floats round
  EXPECT_EQ(find_light_layers(file, "a.exr").rest, "");
  value(file, "R") *= 1.5f;
  EXPECT_EQ(find_light_layers(file, "a.exr").rest, "rest_");  // rest is taken
}

TEST(LightLayers, APictureThatWasDenoisedIsMixedFromTheRawOne) {
  ChannelImage file = our_file();
  for (const char* channel : {"R", "G", "B"}) value(file, channel) = 99;
  add_layer("raw", {5.5f, 7.5f, 9.5f}, &file);
  const LightLayers lights = find_light_layers(file, "a.exr");
  EXPECT_EQ(lights.rest, "");
  const std::vector<LightFactor> ones(3, LightFactor{1, 1, 1});
  EXPECT_FLOAT_EQ(mix_colour(file, lights, ones).image.data[1], 7.5f);
}

TEST(LightLayers, SayInOneLineWhatIsWrong) {
  ChannelImage file = empty_file(1, 1);
  add_layer("", {1, 1, 1}, &file);
  EXPECT_THAT(error_of(file), HasSubstr("--aov lightgroups"));
  add_layer("lightgroup_key", {1, 1, 1}, &file);
  file.channels.back() = "lightgroup_other.A";
  EXPECT_THAT(error_of(file), HasSubstr("lightgroup_key has no channel B"));

  file = empty_file(1, 1);
  add_layer("lightgroup_key", {1, 1, 1}, &file);
  EXPECT_THAT(error_of(file), HasSubstr("no channels R, G and B"));

  file = empty_file(1, 1);
  add_layer("A.Combined_key", {1, 1, 1}, &file);
  add_layer("B.Combined_key", {1, 1, 1}, &file);
  EXPECT_THAT(error_of(file), HasSubstr("more than one view layer"));
}

TEST(LightLayers, SharesAreOfTheMeanLuminance) {
  ChannelImage file = our_file();
  value(file, "lightgroup_key.R", 1) = kNan;  // this pixel is left out
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightShare> shares = light_shares(file, lights);
  EXPECT_THAT(shares[0].mean, ElementsAre(1, 2, 3));
  const double key = 0.2126 + 2 * 0.7152 + 3 * 0.0722, all = 5.5 * 0.2126 + 7.5 * 0.7152 + 9.5 * 0.0722;
  EXPECT_THAT(shares[0].share.value(), DoubleNear(key / all, 1e-9));
  EXPECT_THAT(shares[0].share.value() + shares[1].share.value() + shares[2].share.value(),
              DoubleNear(1, 1e-9));

  ChannelImage black = empty_file(1, 1);
  add_layer("", {0, 0, 0}, &black);
  add_layer("lightgroup_key", {0, 0, 0}, &black);
  EXPECT_FALSE(light_shares(black, find_light_layers(black, "a.exr"))[0].share);
}

TEST(LightMix, ColourAndDifferenceAreWeightedSums) {
  const ChannelImage file = our_file();
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> factors = {{2, 0, 1}, {1, 0.5, 1}, {1, 1, 1}};
  const MixedColour colour = mix_colour(file, lights, factors);
  EXPECT_THAT(colour.image.data, ElementsAre(6.5f, 3, 9.5f, 6.5f, 3, 9.5f));
  ASSERT_TRUE(colour.difference);
  EXPECT_THAT(colour.difference->data, ElementsAre(1, 0.25f, 0.75f, 1, 0.25f, 0.75f));
  EXPECT_THROW(mix_colour(file, lights, std::vector<LightFactor>(2)), std::invalid_argument);
}

TEST(LightMix, FactorsOfOneKeepTheBits) {
  ChannelImage file = our_file();
  value(file, "G") = std::nextafter(7.5f, 8.0f);
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> factors = {{1.5, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  EXPECT_EQ(mix_colour(file, lights, factors).image.data[1], std::nextafter(7.5f, 8.0f));
}

// Half the groups' differences say nothing of the sum's.
TEST(LightMix, TheDifferenceNeedsThatOfEachGroup) {
  ChannelImage file = our_file();
  for (size_t i = file.channels.size() - 3; i < file.channels.size(); ++i) file.channels[i] = "x.R";
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> factors = {{2, 2, 2}, {1, 1, 1}, {1, 1, 1}}, ones(3, LightFactor{1, 1, 1});
  const MixedColour colour = mix_colour(file, lights, factors);
  EXPECT_FALSE(colour.difference);
  EXPECT_THAT(mix_layers(file, lights, factors, colour).left_out, ElementsAre("x", "difference"));
  EXPECT_TRUE(mix_colour(file, lights, ones).difference);
}

TEST(LightMix, AGroupThatIsOutMayBeNaN) {
  ChannelImage file = our_file(1, 1);
  value(file, "lightgroup_key.R") = kNan;
  value(file, "lightgroup_fill.G") = kNan;
  value(file, "R") = value(file, "G") = kNan;
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> factors = {{0, 0, 0}, {1, 1, 1}, {1, 1, 1}};
  const MixedColour colour = mix_colour(file, lights, factors);
  EXPECT_EQ(colour.image.data[0], 4.5f);
  EXPECT_TRUE(std::isnan(colour.image.data[1]));
  MixedLayers beside = mix_layers(file, lights, factors, colour);
  EXPECT_EQ(value(beside.layers, "lightgroup_key.R"), 0);
}

TEST(LightMix, LayersOfLightAreLeftOutAndOthersStay) {
  ChannelImage file = our_file();
  for (const char* layer : {"albedo", "albedo_difference", "direct", "variance", "crypto00", "error"})
    add_layer(layer, {0.1f, 0.2f, 0.3f}, &file);
  add_layer("tail", {0.5f, 2, 3}, &file);
  const size_t last = file.channels.size();
  file.channels[last - 3] = "A", file.channels[last - 2] = "depth.Z", file.channels[last - 1] = "samples.V";
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> factors = {{2, 2, 2}, {0, 0, 0}, {1, 1, 1}};
  MixedLayers beside = mix_layers(file, lights, factors, mix_colour(file, lights, factors));
  EXPECT_THAT(beside.left_out, ElementsAre("direct", "variance", "error"));
  const auto has = [&](const char* name) {
    return std::find(beside.layers.channels.begin(), beside.layers.channels.end(), name) !=
           beside.layers.channels.end();
  };
  for (const char* there : {"albedo.G", "albedo_difference.B", "crypto00.R", "A", "depth.Z", "samples.V",
                            "difference.R", "lightgroup_rest_difference.R"}) {
    EXPECT_TRUE(has(there)) << there;
  }
  for (const char* gone : {"R", "direct.R", "error.R"}) EXPECT_FALSE(has(gone)) << gone;
  EXPECT_EQ(value(beside.layers, "lightgroup_key.B", 1), 6);
  EXPECT_EQ(value(beside.layers, "lightgroup_key_difference.B", 1), 0.5f);
  EXPECT_EQ(value(beside.layers, "depth.Z", 1), 2);
  EXPECT_EQ(value(beside.layers, "difference.R", 1), 0.5f);
}

// So `mix` of a mix is the mix with the products of the factors.
TEST(LightMix, MixesCanBeMixed) {
  const ChannelImage file = our_file();
  const LightLayers lights = find_light_layers(file, "a.exr");
  const std::vector<LightFactor> first = {{2, 2, 2}, {0.5, 1, 1}, {1, 1, 1}},
                                 second = {{3, 1, 1}, {1, 4, 1}, {1, 1, 1}},
                                 both = {{6, 2, 2}, {0.5, 4, 1}, {1, 1, 1}};
  const MixedColour once = mix_colour(file, lights, first);
  ChannelImage mixed = empty_file(2, 1);
  add_layer("", {once.image.data[0], once.image.data[1], once.image.data[2]}, &mixed);
  MixedLayers beside = mix_layers(file, lights, first, once);
  EXPECT_THAT(beside.left_out, IsEmpty());
  for (size_t i = 0; i < beside.layers.channels.size(); i += 3) {
    const std::string& name = beside.layers.channels[i];
    const float* at = &beside.layers.image.data[i];
    add_layer(name.substr(0, name.rfind('.')), {at[0], at[1], at[2]}, &mixed);
  }
  const LightLayers again = find_light_layers(mixed, "b.exr");
  EXPECT_EQ(again.names(), lights.names());
  const MixedColour twice = mix_colour(mixed, again, second), at_once = mix_colour(file, lights, both);
  EXPECT_THAT(twice.image.data, Pointwise(FloatNear(1e-5f), at_once.image.data));
  EXPECT_THAT(twice.difference->data, Pointwise(FloatNear(1e-6f), at_once.difference->data));
}

}  // namespace
}  // namespace lightmill
