// Layers by the names that renderers give them.
#include "common/image/denoise/layers.h"

#include <gmock/gmock.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// One pixel, in which channel number i has the value i.
ChannelImage file_with(const std::vector<std::string>& channels) {
  ChannelImage file;
  file.channels = channels;
  file.image = Image(1, 1, static_cast<int>(channels.size()));
  for (size_t i = 0; i < channels.size(); ++i) file.image.data[i] = static_cast<float>(i);
  return file;
}

TEST(DenoiseLayers, OursAreFound) {
  const ChannelImage file =
      file_with({"R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z",
                 "depth.Z", "difference.R", "difference.G", "difference.B", "albedo_difference.R",
                 "albedo_difference.G", "albedo_difference.B", "depth_difference.Z"});
  const DenoiseLayers layers = find_denoise_layers(file, "a.exr");
  EXPECT_TRUE(layers.has_albedo && layers.has_normal && layers.has_depth && layers.has_difference);
  EXPECT_THAT(layers.input.colour[2], ElementsAre(2));
  EXPECT_THAT(layers.input.albedo[0].values, ElementsAre(3));
  EXPECT_THAT(layers.input.normal[1].values, ElementsAre(7));
  EXPECT_THAT(layers.input.depth.values, ElementsAre(9));
  EXPECT_THAT(layers.input.difference[0], ElementsAre(10));
  EXPECT_THAT(layers.input.albedo[2].difference, ElementsAre(15));
  EXPECT_THAT(layers.input.depth.difference, ElementsAre(16));
  EXPECT_TRUE(layers.input.normal[0].difference.empty());
}

TEST(DenoiseLayers, AColourAndItsLayersAreAsAFileHasThem) {
  Image colour(2, 1);
  colour.data = {1, 2, 3, 4, 5, 6};
  const ChannelImage plain = as_channels(colour, {});
  EXPECT_THAT(plain.channels, ElementsAre("R", "G", "B"));
  EXPECT_EQ(plain.image.data, colour.data);
  ChannelImage depth{Image(2, 1, 1), {"depth.Z"}};
  depth.image.data = {7, 8};
  const ChannelImage both = as_channels(colour, depth);
  EXPECT_THAT(both.channels, ElementsAre("R", "G", "B", "depth.Z"));
  EXPECT_THAT(both.image.data, ElementsAre(1, 2, 3, 7, 4, 5, 6, 8));
}

TEST(DenoiseLayers, ThoseOfOtherRenderersAre) {
  DenoiseLayers layers = find_denoise_layers(file_with({"B", "G", "R", "Albedo.B", "Albedo.G", "Albedo.R",
                                                        "N.X", "N.Y", "N.Z", "Ns.X", "Ns.Y", "Ns.Z"}),
                                             "pbrt.exr");
  EXPECT_THAT(layers.input.colour[0], ElementsAre(2));
  EXPECT_THAT(layers.input.albedo[0].values, ElementsAre(5));
  EXPECT_THAT(layers.input.normal[0].values, ElementsAre(9));
  EXPECT_FALSE(layers.has_depth || layers.has_difference);

  layers = find_denoise_layers(
      file_with({"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
                 "ViewLayer.Noisy Image.R", "ViewLayer.Noisy Image.G", "ViewLayer.Noisy Image.B",
                 "ViewLayer.Denoising Albedo.R", "ViewLayer.Denoising Albedo.G",
                 "ViewLayer.Denoising Albedo.B", "ViewLayer.Depth.Z"}),
      "cycles.exr");
  EXPECT_THAT(layers.input.colour[0], ElementsAre(3));
  EXPECT_THAT(layers.input.albedo[1].values, ElementsAre(7));
  EXPECT_THAT(layers.input.depth.values, ElementsAre(9));

  layers = find_denoise_layers(file_with({"r", "g", "b", "Z"}), "other.exr");
  EXPECT_THAT(layers.input.depth.values, ElementsAre(3));
}

TEST(DenoiseLayers, WithoutColourThereIsNothingToDo) {
  try {
    find_denoise_layers(file_with({"R", "G", "normal.X"}), "a.exr");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage);
    EXPECT_THAT(e.what(), HasSubstr("a.exr"));
  }
}

TEST(DenoiseLayers, WhatIsWrittenKeepsTheRawColourAndTheRest) {
  const ChannelImage file = file_with({"B", "G", "R", "A", "depth.Z"});
  DenoiseResult result;
  result.squared_error = {0.25f};
  ChannelImage out = denoised_layers(file, find_denoise_layers(file, ""), result);
  EXPECT_THAT(out.channels, ElementsAre("raw.R", "raw.G", "raw.B", "error.V", "A", "depth.Z"));
  EXPECT_THAT(out.image.data, ElementsAre(2, 1, 0, 0.5f, 3, 4));

  // Denoised again, it starts from the raw colour and keeps it.
  std::vector<std::string> channels = {"R", "G", "B"};
  channels.insert(channels.end(), out.channels.begin(), out.channels.end());
  const ChannelImage again = file_with(channels);
  const DenoiseLayers layers = find_denoise_layers(again, "");
  EXPECT_THAT(layers.input.colour[0], ElementsAre(3));
  out = denoised_layers(again, layers, result);
  EXPECT_THAT(out.channels, ElementsAre("raw.R", "raw.G", "raw.B", "error.V", "A", "depth.Z"));
  EXPECT_EQ(out.image.data[0], 3);
}

}  // namespace
}  // namespace lightmill
