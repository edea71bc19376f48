#include "common/scene/spectrum/color_space.h"

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

// ITU-R BT.2087, the inverse of equation (M) there, to four digits.
TEST(ColorSpaces, Rec2020ComesByTheStandardsMatrix) {
  const double expected[3][3] = {
      {1.6605, -0.5876, -0.0728}, {-0.1246, 1.1329, -0.0083}, {-0.0182, -0.1006, 1.1187}};
  for (size_t c = 0; c < 3; ++c) {
    std::array<double, 3> unit{};
    unit[c] = 1;
    const auto rgb = to_rec709(ColorSpace::kRec2020, unit, true);
    for (size_t r = 0; r < 3; ++r) EXPECT_NEAR(rgb[r], expected[r][c], 1e-4) << r << c;
  }
}

TEST(ColorSpaces, GreyFactorsStayGreyAndAcesLightIsWarm) {
  for (const ColorSpace space :
       {ColorSpace::kSrgb, ColorSpace::kRec2020, ColorSpace::kAces, ColorSpace::kDciP3}) {
    for (const double x : to_rec709(space, {0.3, 0.3, 0.3}, false)) EXPECT_NEAR(x, 0.3, 1e-12);
  }
  // CIE XYZ of the white (0.32168, 0.33767) by IEC 61966-2-1's matrix.
  const auto white = to_rec709(ColorSpace::kAces, {1, 1, 1}, true);
  EXPECT_NEAR(white[0], 1.0469, 1e-3);
  EXPECT_NEAR(white[1], 0.9946, 1e-3);
  EXPECT_NEAR(white[2], 0.9155, 1e-3);
}

class ColorSpaceDirective : public SceneTest {};

TEST_F(ColorSpaceDirective, HoldsForWhatFollowsInItsBlock) {
  const std::string grey = " \"string type\" \"diffuse\" \"rgb reflectance\" [.5 .4 .4] ";
  const SceneDescription scene = clean_world("AttributeBegin ColorSpace \"Rec2020\" MakeNamedMaterial \"a\"" +
                                             grey + "AttributeEnd MakeNamedMaterial \"b\"" + grey);
  const auto color = [&](size_t i) {
    return std::get<DiffuseMaterial>(scene.materials.at(i).kind).reflectance.value;
  };
  size_t a = 0;
  while (scene.materials.at(a).name != "a") ++a;
  EXPECT_NEAR(color(a).r, 0.4 + 0.1 * 1.6605, 1e-4);
  EXPECT_NEAR(color(a).g, 0.4 - 0.1 * 0.1246, 1e-4);
  EXPECT_EQ(color(a + 1), (Rgb{0.5f, 0.4f, 0.4f}));
}

}  // namespace
}  // namespace lightmill
