// `lightmill mix`: from a file with light groups to one in another light, and what it says of wrong input.
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr float kInf = std::numeric_limits<float>::infinity();

class MixVerb : public testing::CliTest {
 protected:
  /// A picture of 0.75 in all channels: key 0.5, fill 0.25. The layers have one value in all pixels.
  void write_lights(const std::string& path, std::vector<std::pair<std::string, float>> more = {},
                    int width = 8, int height = 4) {
    std::vector<std::pair<std::string, float>> layers = {{"lightgroup_key", 0.5f},
                                                         {"lightgroup_fill", 0.25f}};
    layers.insert(layers.end(), more.begin(), more.end());
    Image image(width, height);
    std::fill(image.data.begin(), image.data.end(), 0.75f);
    ChannelImage beside{Image(width, height, static_cast<int>(3 * layers.size())), {}};
    for (const auto& layer : layers) {
      for (const char* c : {".R", ".G", ".B"}) beside.channels.push_back(layer.first + c);
    }
    for (size_t i = 0; i < beside.image.data.size(); ++i)
      beside.image.data[i] = layers[i / 3 % layers.size()].second;
    write_image(image, path, {false, {{"scene", "abc"}, {"relmse", "0.5"}}, &beside, {}});
  }
  void write_halves(const std::string& path, int width = 8, int height = 4) {
    write_lights(path,
                 {{"difference", 0.03f},
                  {"lightgroup_key_difference", 0.02f},
                  {"lightgroup_fill_difference", 0.01f},
                  {"albedo", 0.5f},
                  {"direct", 0.3f}},
                 width, height);
  }
};

TEST_F(MixVerb, WritesTheWeightedSumAndItsError) {
  write_halves("a.exr");
  const testing::Outcome outcome = run({"mix", "a.exr", "key=2", "fill=0,1,4", "-o", "b.exr", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("another light: direct"));
  EXPECT_EQ(lines(outcome.err), 1);
  const ChannelImage mixed = read_channels("b.exr", 1000);
  EXPECT_THAT(read_image("b.exr").data, Contains(2));
  EXPECT_EQ(read_image("b.exr").data[0], 1);
  EXPECT_EQ(read_image("b.exr").data[1], 1.25f);
  for (const char* channel : {"lightgroup_key.R", "lightgroup_fill_difference.B", "difference.G", "albedo.R"})
    EXPECT_THAT(mixed.channels, Contains(channel));
  EXPECT_THAT(mixed.channels, Not(Contains("direct.R")));

  const nlohmann::json said = nlohmann::json::parse(outcome.out);
  const double r = 0.04 * 0.04 / (1 + 0.01), g = 0.05 * 0.05 / (1.25 * 1.25 + 0.01),
               b = 0.08 * 0.08 / (4 + 0.01);
  EXPECT_NEAR(said["relmse"].get<double>(), (r + g + b) / 3, 2e-5);
  EXPECT_NEAR(said["relmse_before"].get<double>(), 0.0009 / (0.75 * 0.75 + 0.01), 2e-5);
  EXPECT_EQ(said["groups"][0]["factor"], nlohmann::json({0, 1, 4}));
  EXPECT_EQ(said["left_out"], nlohmann::json({"direct"}));

  EXPECT_EQ(read_image_metadata("b.exr", "scene"), "abc");
  EXPECT_EQ(read_image_metadata("b.exr", "relmse"), "");  // it was that of another light
  EXPECT_EQ(read_image_metadata("b.exr", "light_mix"), "key=2 fill=0,1,4");
  EXPECT_NE(read_image_metadata("b.exr", "mixed_relmse"), "");

  EXPECT_EQ(run({"mix", "b.exr", "key=0.5", "-o", "c.exr", "--quiet"}).code, 0);
  EXPECT_EQ(read_image("c.exr").data[0], 0.5f);
  EXPECT_EQ(read_image_metadata("c.exr", "light_mix"), "key=2 fill=0,1,4 key=0.5");
}

TEST_F(MixVerb, WhatItWritesCanBeDenoised) {
  write_halves("a.exr");
  ASSERT_EQ(run({"mix", "a.exr", "key=2", "-o", "b.exr", "--quiet"}).code, 0);
  testing::Outcome outcome = run({"denoise", "b.exr", "-o", "c.exr", "--json", "--quiet"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\"difference\": true"));
  // In one go it is the same, and a picture that was denoised is mixed from the raw one.
  outcome = run({"mix", "a.exr", "key=2", "--denoise", "-o", "d.exr", "--json", "--quiet"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\"denoised\": {"));
  EXPECT_EQ(read_image("d.exr").data, read_image("c.exr").data);
  EXPECT_EQ(run({"mix", "d.exr", "-o", "e.exr", "--quiet"}).code, 0);
  EXPECT_EQ(read_image("e.exr").data, read_image("b.exr").data);
}

TEST_F(MixVerb, OtherFormatsHoldThePictureAlone) {
  write_halves("a.exr", 1, 1);
  const testing::Outcome outcome =
      run({"mix", "a.exr", "key=0.5", "-o", "b.png", "--view", "filmic", "--exposure", "1"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("estimated relMSE"));
  EXPECT_EQ(lines(outcome.err), 1);
  EXPECT_EQ(run({"mix", "a.exr", "-o", "b.pfm", "--quiet"}).code, 0);
  EXPECT_THAT(read_image("b.pfm").data, ElementsAre(0.75f, 0.75f, 0.75f));
}

TEST_F(MixVerb, ListsTheGroups) {
  write_lights("a.exr");
  const testing::Outcome table = run({"mix", "a.exr"});
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("66.67 %"));
  EXPECT_THAT(table.out, HasSubstr("fill"));
  EXPECT_EQ(lines(table.out), 3);
  const nlohmann::json said = nlohmann::json::parse(run({"mix", "a.exr", "--json"}).out);
  EXPECT_EQ(said["groups"][0]["name"], "fill");  // channels of an .exr are sorted by name
  EXPECT_NEAR(said["groups"][0]["share"].get<double>(), 1.0 / 3, 1e-6);
  EXPECT_EQ(said["groups"][0]["mean"], nlohmann::json({0.25, 0.25, 0.25}));
}

TEST_F(MixVerb, SaysWhatItDoesNotKnow) {
  write_lights("plain.exr");
  testing::Outcome outcome = run({"mix", "plain.exr", "key=2", "-o", "a.exr"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("--aov lightgroups,difference"));
  EXPECT_EQ(lines(outcome.err), 1);
  EXPECT_THAT(run({"mix", "plain.exr", "key=2", "-o", "a.exr", "--json"}).out, HasSubstr("\"relmse\": null"));

  write_lights(
      "one.exr",
      {{"difference", 0.f}, {"lightgroup_key_difference", 0.f}, {"lightgroup_fill_difference", 0.f}});
  EXPECT_THAT(run({"mix", "one.exr", "key=2", "-o", "a.exr"}).err, HasSubstr("1 sample per pixel"));

  write_lights("bright.exr", {{"lightgroup_lamp", kInf}}, 2, 2);
  EXPECT_THAT(run({"mix", "bright.exr", "key=2", "-o", "a.exr"}).err, HasSubstr("4 pixels are NaN"));
  outcome = run({"mix", "bright.exr", "key=2", "lamp=0", "-o", "a.exr"});
  EXPECT_THAT(outcome.err, Not(HasSubstr("NaN")));
  EXPECT_EQ(read_image("a.exr").data[0], 1.25f);
}

TEST_F(MixVerb, SaysInOneLineWhatIsWrong) {
  write_lights("a.exr");
  write_image(Image(8, 4), "plain.exr");
  write_image(Image(8, 4), "bytes.png");
  const std::vector<std::pair<std::vector<std::string>, const char*>> wrong = {
      {{"mix", "a.exr", "key=1"}, "-o is required"},
      {{"mix", "a.exr", "--denoise"}, "-o is required"},
      {{"mix", "a.exr", "kye=1", "-o", "b.exr"}, "it has fill, key"},
      {{"mix", "a.exr", "key=1", "key=2", "-o", "b.exr"}, "a factor already"},
      {{"mix", "a.exr", "key", "-o", "b.exr"}, "NAME=FACTOR"},
      {{"mix", "a.exr", "=1", "-o", "b.exr"}, "NAME=FACTOR"},
      {{"mix", "a.exr", "key=", "-o", "b.exr"}, "NAME=FACTOR"},
      {{"mix", "a.exr", "key=-1", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "a.exr", "key=nan", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "a.exr", "key=inf", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "a.exr", "key=1,2", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "a.exr", "key=1,2,3,", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "a.exr", "key=1x", "-o", "b.exr"}, "from 0 to 1e9"},
      {{"mix", "plain.exr"}, "--aov lightgroups"},
      {{"mix", "absent.exr"}, "no such file"},
      {{"mix", "bytes.png"}, "does not hold floats"},
      {{"mix", "a.exr", "key=1", "-o", "nowhere/a.exr"}, "no folder"},
      {{"mix", "a.exr", "key=1", "-o", "b.pfm", "--half"}, "--half"},
  };
  for (const auto& [command, says] : wrong) {
    const testing::Outcome outcome = run(command);
    EXPECT_NE(outcome.code, 0) << says;
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_EQ(lines(outcome.err), 1) << outcome.err;
  }
}

}  // namespace
}  // namespace lightmill::client
