// Views of OpenColorIO configurations, against values worked out by hand.
#include "common/image/color_config.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <regex>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/common/image/ocio_config.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAreArray;
using ::testing::FloatNear;
using ::testing::HasSubstr;
using testing::ocio_config;
using testing::TempFolder;

std::string config_with(const std::string& what, const std::string& instead) {
  return std::regex_replace(ocio_config(), std::regex(what), instead);
}

std::string config_file(const TempFolder& folder, const std::string& text) {
  std::ofstream(folder / "config.ocio") << text;
  return folder / "config.ocio";
}

std::string failure_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kFailed);
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

void expect_pixel(const ConfigView& view, std::vector<float> rgb, const std::vector<float>& expected) {
  view.apply(rgb.data(), rgb.size() / 3);
  for (size_t i = 0; i < rgb.size(); ++i) EXPECT_NEAR(rgb[i], expected[i], 2e-5) << i;
}

TEST(ColorConfig, ViewsAreThoseOfTheFile) {
  const TempFolder folder;
  const ColorConfig config(config_file(folder, ocio_config()));
  EXPECT_EQ(config.view_list(), "Root, Swap, filmic, Projector/Root, Projector/View/2");
  expect_pixel(*config.find_view("Root"), {0.25f, 0.49f, 1, 0.01f, 4, 0}, {0.5f, 0.7f, 1, 0.1f, 2, 0});
  expect_pixel(*config.find_view("Swap"), {0.25f, 0.5f, 1}, {0.25f, 0.125f, 0.5f});
  expect_pixel(*config.find_view("Projector/Root"), {0.25f, 0.5f, 1}, {0.25f, 0.125f, 0.5f});
  EXPECT_TRUE(config.find_view("Screen/Root"));
  EXPECT_TRUE(config.find_view("Projector/View/2"));
  for (const char* name : {"", "root", "View/2", "Screen/View/2", "Screen", "Screen/", "Projector/Swap"})
    EXPECT_FALSE(config.find_view(name)) << name;
}

// The matrix is the published one from Rec.709 to ACES2065-1: a space that does nothing shows it.
TEST(ColorConfig, AConfigurationOfAcesGetsAcesValues) {
  const TempFolder folder;
  const std::string unknown = config_with("    aliases: .*\n", "");
  const std::vector<float> color = {0, 1, 0}, aces = {0.813439f * 0.5f, 0.382989f * 0.5f,
                                                      0.111547f * 0.5f};  // swapped and halved
  for (const auto& [what, instead] :
       {std::pair{"scene_linear: linear light", "aces_interchange: linear light"},
        {"linear light", "ACES2065-1"}}) {
    const ColorConfig config(config_file(folder, std::regex_replace(unknown, std::regex(what), instead)));
    expect_pixel(*config.find_view("Swap"), color, aces);
  }
  // What is called Rec.709 is taken before.
  const ColorConfig both(
      config_file(folder, config_with("default: raw", "default: raw\n  aces_interchange: root")));
  expect_pixel(*both.find_view("Swap"), color, {0.5f, 0, 0});
}

TEST(ColorConfig, TheSpaceOfOurPixelsIsFoundByItsUsualNames) {
  const auto space = [](const std::string& name, std::vector<std::string> aliases = {}) {
    return ColorConfigContents::Space{name, std::move(aliases)};
  };
  ColorConfigContents contents;
  std::string rec709, asked;
  const auto found = [&] {
    asked.clear();
    const ConfigInput input = config_input(
        contents,
        [&](const std::string& candidate, const std::string& aces) {
          asked += candidate + "-" + aces + " ";
          return candidate == rec709;
        },
        "studio.ocio");
    return input.space + (input.is_aces ? " (ACES)" : "");
  };
  contents.roles = {{"scene_linear", "ACEScg"}};
  contents.spaces = {space("ACES2065-1"), space("ACEScg"), space("Linear"), space("utility - linear - srgb")};
  EXPECT_EQ(found(), "utility - linear - srgb");
  contents.spaces.pop_back();
  EXPECT_EQ(found(), "ACES2065-1 (ACES)");
  EXPECT_EQ(asked, "ACEScg-ACES2065-1 Linear-ACES2065-1 ");
  rec709 = "Linear";
  EXPECT_EQ(found(), "Linear");
  contents.roles.emplace_back("aces_interchange", "Exchange");
  rec709.clear();
  EXPECT_EQ(found(), "Exchange (ACES)");
  contents.spaces = {space("linear"), space("Our Rec.709")};
  contents.roles = {{"scene_linear", "Our Rec.709"}};
  EXPECT_EQ(found(), "Our Rec.709");
  contents.roles.clear();
  EXPECT_EQ(found(), "linear");
  EXPECT_EQ(asked, "");
  contents.spaces = {space("camera", {"log"})};
  EXPECT_THAT(failure_of(found),
              AllOf(HasSubstr("studio.ocio: "), HasSubstr("\"lin_rec709\""), HasSubstr("aces_interchange"),
                    HasSubstr("\"ACES2065-1\""), HasSubstr("scene_linear")));
}

// A space that is linear Rec.709 without a name that says so is told by what the configuration makes of it.
TEST(ColorConfig, ASceneSpaceIsRec709IfItsWayToAcesIs) {
  const TempFolder folder;
  const std::string matrix =
      "[0.439633, 0.382989, 0.177378, 0, 0.089776, 0.813439, 0.096784, 0, 0.017541, 0.111547, 0.870912, 0, "
      "0, 0, 0, 1]";
  const auto swapped_green = [&](const std::string& to_aces) {
    const std::string text = config_with("    aliases: .*\n", "") +
                             "  - !<ColorSpace>\n    name: exchange\n    from_scene_reference: " + to_aces +
                             "\n";
    const ColorConfig config(config_file(
        folder,
        std::regex_replace(text, std::regex("default: raw"), "default: raw\n  aces_interchange: exchange")));
    std::vector<float> rgb = {0, 1, 0};
    config.find_view("Swap")->apply(rgb.data(), 1);
    return rgb[0];
  };
  EXPECT_NEAR(swapped_green("!<MatrixTransform> {matrix: " + matrix + "}"), 0.5f, 1e-5);
  // Here it is not: its values are those of ACES to the fourth power.
  EXPECT_NEAR(swapped_green("!<ExponentTransform> {value: 0.25}"), 0.5 * std::pow(0.813439, 4), 1e-4);
}

TEST(ColorConfig, BadFilesAreOneLineErrors) {
  const TempFolder folder;
  EXPECT_THAT(failure_of([&] { ColorConfig(folder / "none.ocio"); }),
              HasSubstr("none.ocio: there is no such"));
  EXPECT_THAT(failure_of([&] { ColorConfig(folder.path().string()); }), HasSubstr("there is no such file"));
  for (const std::string& text :
       {std::string("bad"), std::string(), std::string("a: [1\nb: 2\n"), std::string(1000, '\0'),
        config_with("profile_version: 2", "profile_version: 9")}) {
    EXPECT_THAT(failure_of([&] { ColorConfig(config_file(folder, text)); }),
                HasSubstr("config.ocio: it can't be read as an OpenColorIO configuration: "));
  }
  const ColorConfig lacks(
      config_file(folder, config_with("!<ExponentTransform> .*", "!<FileTransform> {src: none.cube}")));
  EXPECT_TRUE(lacks.find_view("Swap"));
  EXPECT_THAT(failure_of([&] { lacks.find_view("Root"); }),
              AllOf(HasSubstr("config.ocio: view \"Root\": "), HasSubstr("none.cube")));
}

TEST(ColorConfig, APngHasTheValuesOfTheView) {
  const TempFolder folder;
  const ColorConfig config(config_file(folder, ocio_config()));
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  // More than are worked on at once, in rows that do not divide them.
  Image image(1000, 50);
  const std::vector<float> pixel = {0.25f, 0.0025f, inf};
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = pixel[i % 3];
  const std::vector<float> odd = {nan, -1, 0.0625f};
  std::copy(odd.begin(), odd.end(), image.data.end() - 3);
  const ViewTransform view{ViewCurve::kSrgb, 2, config.find_view("Root")};
  write_image(image, folder / "a.png", {.view = view});
  const auto in = OIIO::ImageInput::open(folder / "a.png");
  std::vector<uint8_t> bytes(image.data.size());
  ASSERT_TRUE(in && in->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, bytes.data()));
  const std::vector<uint8_t> expected = {255, 26, 255};  // roots of four times the values
  for (size_t i = 0; i + 3 < bytes.size(); ++i) ASSERT_EQ(bytes[i], expected[i % 3]) << i;
  EXPECT_THAT(std::vector<uint8_t>(bytes.end() - 3, bytes.end()), ElementsAreArray({0, 0, 128}));

  float out[2];
  EXPECT_THROW(view_pixels(pixel.data(), 2, 1, view, out), std::logic_error) << "greys have no such view";
  view_pixels(pixel.data(), 2, 1, {}, out);
  EXPECT_EQ(out[0], linear_to_srgb(0.25f));
}

}  // namespace
}  // namespace lightmill
