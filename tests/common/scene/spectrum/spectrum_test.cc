#include "common/scene/spectrum/spectrum.h"

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

void expect_near(const Rgb& a, const Rgb& b, float tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

TEST(Spectrum, ConstantFactorIsExact) {
  EXPECT_EQ(factor_to_rgb({{400, 700}, {0.25, 0.25}}), (Rgb{0.25f, 0.25f, 0.25f}));
}

TEST(Spectrum, ANarrowBandHasItsColor) {
  const Rgb red = factor_to_rgb({{599, 600, 700, 701}, {0, 1, 1, 0}});
  EXPECT_GT(red.r, 10 * red.g);
  EXPECT_GT(red.r, 10 * red.b);
  const Rgb blue = factor_to_rgb({{399, 400, 480, 481}, {0, 1, 1, 0}});
  EXPECT_GT(blue.b, 5 * blue.g);
}

TEST(Spectrum, DaylightBlackbodyIsNearlyWhite) {
  // 6504 K on the Planckian locus against D65: a little more magenta, within a few per cent.
  expect_near(blackbody_to_rgb(6504), {1, 1, 1}, 0.08f);
  EXPECT_NEAR(luminance(blackbody_to_rgb(6504)), 1, 0.01);
}

TEST(Spectrum, BlackbodyWarmsAndCools) {
  const Rgb warm = blackbody_to_rgb(2700), cool = blackbody_to_rgb(12000);
  EXPECT_GT(warm.r, 2 * warm.b);
  EXPECT_GT(cool.b, cool.r);
  // 2856 K is illuminant A, whose chromaticity is tabulated.
  expect_near(blackbody_to_rgb(2855.5), *named_illuminant("stdillum-A"), 0.03f);
  for (double kelvin : {200.0, 1000.0, 1e5, 1e6}) {
    const Rgb c = blackbody_to_rgb(kelvin);
    EXPECT_TRUE(c.r >= 0 && c.g >= 0 && c.b >= 0 && c.r < 100) << kelvin;
    EXPECT_GT(c.r + c.g + c.b, 0.5f) << kelvin;
  }
}

TEST(Spectrum, Names) {
  expect_near(*named_illuminant("stdillum-D65"), {1, 1, 1}, 0.01f);
  EXPECT_FLOAT_EQ(*named_glass("glass-BK7"), 1.5168f);
  EXPECT_GT(named_metal("metal-Au-eta")->b, named_metal("metal-Au-eta")->r);
  EXPECT_FALSE(named_metal("metal-Xx-eta"));
  EXPECT_GE(spectrum_names().size(), 30u);
}

// Known colours of clean metals at normal incidence, linear Rec.709 under D65 (Hoffman, "Physics and Math of
// Shading", SIGGRAPH 2013 course, from measured n and k); gold's red lies outside Rec.709.
TEST(Spectrum, MetalsHaveTheirColours) {
  const auto reflectance = [](const std::string& metal) {
    const Rgb n = *named_metal(metal + "-eta"), k = *named_metal(metal + "-k");
    const auto f0 = [](float x, float y) {
      return ((x - 1) * (x - 1) + y * y) / ((x + 1) * (x + 1) + y * y);
    };
    return Rgb{f0(n.r, k.r), f0(n.g, k.g), f0(n.b, k.b)};
  };
  expect_near(reflectance("metal-Au"), {1.000f, 0.782f, 0.344f}, 0.011f);
  expect_near(reflectance("metal-Ag"), {0.972f, 0.960f, 0.915f}, 0.002f);
  expect_near(reflectance("metal-Al"), {0.913f, 0.922f, 0.924f}, 0.002f);
  expect_near(reflectance("metal-Cu"), {0.955f, 0.638f, 0.538f}, 0.002f);
}

class SpectrumParameters : public SceneTest {
 protected:
  Rgb reflectance(const std::string& parameter) {
    const SceneDescription s = clean_world("Material \"diffuse\" " + parameter);
    return std::get<DiffuseMaterial>(s.materials.back().kind).reflectance.value;
  }
  Rgb emission(const std::string& parameter) {
    const SceneDescription s = clean_world("LightSource \"infinite\" " + parameter);
    return std::get<InfiniteLight>(s.lights.back().kind).radiance;
  }
};

TEST_F(SpectrumParameters, InlinePairsAndFiles) {
  expect_near(reflectance("\"spectrum reflectance\" [300 0.3 800 0.3]"), {0.3f, 0.3f, 0.3f}, 1e-6f);
  folder_.write("spds/half.spd", "# nm value\n400 0.5\n700 0.5\n");
  expect_near(reflectance("\"spectrum reflectance\" \"spds/half.spd\""), {0.5f, 0.5f, 0.5f}, 1e-6f);
}

TEST_F(SpectrumParameters, EmissionHasLuminanceOne) {
  EXPECT_NEAR(luminance(emission("\"blackbody L\" 4000")), 1, 0.01);
  EXPECT_NEAR(luminance(emission("\"spectrum L\" [300 7 800 7]")), 1, 0.01);
  expect_near(emission("\"spectrum L\" \"stdillum-D65\" \"float scale\" 3"), {3, 3, 3}, 0.03f);
  EXPECT_EQ(emission("\"rgb L\" [3 2 1]"), (Rgb{3, 2, 1})) << "rgb is taken as it is";
}

TEST_F(SpectrumParameters, Mistakes) {
  const std::pair<const char*, const char*> cases[] = {
      {"Material \"conductor\" \"spectrum eta\" \"metal-Ag-et\"", "did you mean \"metal-Ag-eta\"?"},
      {"Material \"diffuse\" \"spectrum reflectance\" [400 0.5 500]", "pairs of wavelength and value"},
      {"Material \"diffuse\" \"spectrum reflectance\" [500 0.5 400 0.5]", "wavelengths in nm that increase"},
      {"Material \"diffuse\" \"spectrum reflectance\" [400 -0.5 500 1.5]", "needs values >= 0"},
      {"Material \"diffuse\" \"spectrum reflectance\" \"no.spd\"", "there is no file \"no.spd\""},
      {"LightSource \"point\" \"blackbody I\" -5", "temperature"},
      {"LightSource \"point\" \"rgb I\" [1 -1 1]", "must not be negative"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly_world(text), message)) << text;
  const LoadResult bright = load_world("Material \"diffuse\" \"spectrum reflectance\" [300 1.5 800 1.5]");
  EXPECT_TRUE(bright.ok()) << "as pbrt does";
  EXPECT_TRUE(mentions(bright, "values up to 1.5")) << listed(bright);
  folder_.write("bad.spd", "400 x");
  EXPECT_TRUE(has_error(strictly_world("LightSource \"point\" \"spectrum I\" \"bad.spd\""),
                        "pairs of wavelength and value"));
}

}  // namespace
}  // namespace lightmill
