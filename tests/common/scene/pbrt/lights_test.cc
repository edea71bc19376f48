// LightSource: magnitudes as pbrt's, the sun, and what is refused.
#include <cmath>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class Lights : public SceneTest {
 protected:
  template <class Light>
  Light only(const std::string& text) {
    const SceneDescription s = clean(load("WorldBegin\nLightSource " + text));
    return std::get<Light>(s.lights.at(0).kind);
  }
};

TEST_F(Lights, PowerAndIlluminanceReplaceTheMagnitude) {
  EXPECT_NEAR(only<PointLight>("\"point\" \"rgb I\" [1 2 3] \"float scale\" 2").intensity.g, 4, 1e-6);
  EXPECT_NEAR(only<PointLight>("\"point\" \"float power\" 100").intensity.r, 100 / (4 * M_PI), 1e-4);
  EXPECT_NEAR(only<DistantLight>("\"distant\" \"float illuminance\" 7").irradiance.r, 7, 1e-5);
  EXPECT_NEAR(only<InfiniteLight>("\"infinite\" \"float illuminance\" 7").radiance.r, 7 / M_PI, 1e-5);
  const auto spot =
      only<SpotLight>("\"spot\" \"float power\" 10 \"float coneangle\" 60 \"float conedeltaangle\" 20");
  EXPECT_EQ(spot.total_width, 60);
  EXPECT_EQ(spot.falloff_start, 40);
  const double start = std::cos(40 * M_PI / 180), end = 0.5;
  EXPECT_NEAR(spot.intensity.r, 10 / (2 * M_PI * (1 - start + (start - end) / 2)), 1e-4);
}

TEST_F(Lights, AMagnitudeThatIsNoneIsNamed) {
  EXPECT_TRUE(
      mentions(load_world("LightSource \"point\" \"float power\" -10"), "\"power\" of light \"point\""));
  EXPECT_TRUE(mentions(load_world("LightSource \"infinite\" \"float illuminance\" 0"), "is ignored"));
  EXPECT_TRUE(load_world("LightSource \"point\" \"float power\" -1").problems.empty()) << "pbrt's default";
}

TEST_F(Lights, ADistantLightWithAnAngleIsASun) {
  EXPECT_EQ(only<DistantLight>("\"distant\"").half_angle_degrees, 0);
  EXPECT_EQ(only<DistantLight>("\"distant\" \"float angle\" 0.2665").half_angle_degrees, 0.2665);
  const LoadResult thin = load("WorldBegin\nLightSource \"distant\" \"float angle\" 1e-7");
  EXPECT_TRUE(mentions(thin, "scene.pbrt:2:")) << listed(thin);
  EXPECT_TRUE(mentions(thin, "parallel light")) << listed(thin);
  EXPECT_EQ(std::get<DistantLight>(thin.scene.lights.at(0).kind).half_angle_degrees, 0);
}

TEST_F(Lights, RefusesWhatNoLightCanBe) {
  for (const char* text :
       {"\"point\" \"rgb I\" [-1 0 0]", "\"point\" \"rgb I\" [nan 0 0]", "\"point\" \"rgb I\" [1e39 0 0]",
        "\"point\" \"rgb I\" [1e38 1 1] \"float scale\" 1e30", "\"point\" \"float scale\" -1",
        "\"infinite\" \"blackbody L\" 10", "\"spot\" \"float coneangle\" 181",
        "\"spot\" \"float coneangle\" -3", "\"spot\" \"point3 from\" [1 1 1] \"point3 to\" [1 1 1]",
        "\"distant\" \"float angle\" 91", "\"distant\" \"float angle\" -1"}) {
    const LoadResult r = strictly("WorldBegin\nLightSource " + std::string(text));
    EXPECT_TRUE(has_error(r, "scene.pbrt:2:")) << text;
  }
}

TEST_F(Lights, ImagesShineAtAPointAndFromAfar) {
  folder_.write("x.exr", "no picture is read here");
  const std::string file = " \"string filename\" \"x.exr\"";
  const auto gonio =
      only<GoniometricLight>("\"goniometric\" \"rgb I\" [1 2 3] \"float scale\" 2 \"float power\" 5" + file);
  EXPECT_EQ(gonio.intensity, (Rgb{2, 4, 6}));
  EXPECT_EQ(gonio.power, 5);
  EXPECT_NE(gonio.image_path.find("x.exr"), std::string::npos);
  const auto projection = only<ProjectionLight>("\"projection\" \"float fov\" 40 \"float scale\" 3" + file);
  EXPECT_EQ(projection.intensity, (Rgb{3, 3, 3}));
  EXPECT_EQ(projection.fov_degrees, 40);
  EXPECT_EQ(projection.power, 0);
  EXPECT_EQ(only<InfiniteLight>("\"infinite\" \"float illuminance\" 7" + file).illuminance, 7);
  for (const char* text :
       {"\"goniometric\"", "\"projection\"", "\"projection\" \"float fov\" 0 \"string filename\" \"x.exr\"",
        "\"goniometric\" \"string filename\" \"absent.exr\"",
        "\"infinite\" \"rgb L\" [1 1 1] \"string filename\" \"x.exr\""}) {
    EXPECT_TRUE(has_error(strictly("WorldBegin\nLightSource " + std::string(text)), "scene.pbrt:2:")) << text;
  }
  const LoadResult stretched = load("WorldBegin\nScale 1 2 1 LightSource \"projection\"" + file);
  EXPECT_TRUE(mentions(stretched, "scene.pbrt:2:13: ")) << listed(stretched);
  EXPECT_TRUE(mentions(stretched, "stretched or sheared")) << listed(stretched);
}

TEST_F(Lights, AreaLightsTakeImagesAndAlpha) {
  folder_.write("x.exr", "no picture is read here");
  const SceneDescription s = clean(load(R"(WorldBegin
AreaLightSource "diffuse" "string filename" "x.exr" "float scale" 3
Shape "sphere"
Shape "disk" "float alpha" 0
AreaLightSource "diffuse" "string filename" "x.exr" "float power" 10
Shape "bilinearmesh" "point3 P" [0 0 0 2 0 0 0 1 0 2 1 0] "string emissionfilename" "x.exr"
)"));
  ASSERT_EQ(s.shapes.size(), 3u);
  EXPECT_EQ(s.shapes[1].alpha.value, 0);
  const AreaLightDescription& scaled = s.area_lights.at(static_cast<size_t>(s.shapes[0].area_light));
  EXPECT_EQ(scaled.radiance, (Rgb{3, 3, 3}));
  EXPECT_FALSE(scaled.of_mean_luminance);
  EXPECT_EQ(s.shapes[1].area_light, s.shapes[0].area_light);
  const auto& image = std::get<ImageTexture>(s.textures.at(static_cast<size_t>(scaled.texture)).kind);
  EXPECT_EQ(image.wrap, Wrap::kClamp);
  const AreaLightDescription& power = s.area_lights.at(static_cast<size_t>(s.shapes[2].area_light));
  EXPECT_TRUE(power.of_mean_luminance);
  EXPECT_NEAR(power.radiance.g, 10 / (M_PI * 2), 1e-5);
  EXPECT_TRUE(has_error(
      strictly("WorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"string filename\" \"x.exr\""),
      "scene.pbrt:2:27: "));
  EXPECT_TRUE(
      has_error(strictly("WorldBegin\nAreaLightSource \"diffuse\" \"string filename\" \"absent.exr\""),
                "scene.pbrt:2:"));
}

TEST_F(Lights, BelongToGroups) {
  folder_.write("x.exr", "no picture is read here");
  const SceneDescription s = clean(load(R"(WorldBegin
LightSource "point" "string lightgroup" "key"
LightSource "infinite" "string filename" "x.exr" "string lightgroup" "sky"
LightSource "spot" "string lightgroup" "rest"
LightSource "distant" "string lightgroup" ""
AttributeBegin
  Attribute "light" "string lightgroup" "fill"
  LightSource "area"
  AreaLightSource "diffuse"
  Shape "sphere"
AttributeEnd
AreaLightSource "diffuse" "string lightgroup" "screens"
Shape "sphere"
AreaLightSource "diffuse" "string lightgroup" "screens" "float power" 10
Shape "sphere"
AreaLightSource "diffuse"
Shape "sphere"
)"));
  std::vector<std::string> groups, of_shapes;
  for (const LightDescription& light : s.lights) groups.push_back(light.light_group);
  for (const ShapeDescription& shape : s.shapes)
    of_shapes.push_back(s.area_lights.at(static_cast<size_t>(shape.area_light)).light_group);
  EXPECT_EQ(groups, (std::vector<std::string>{"key", "sky", "", "", "fill"}));
  EXPECT_EQ(of_shapes, (std::vector<std::string>{"fill", "screens", "screens", ""}));
}

TEST_F(Lights, NamesOfGroupsAreMadeFitForChannels) {
  const LoadResult r = load(
      "WorldBegin\nLightSource \"point\" \"string lightgroup\" \"key light\"\n"
      "LightSource \"spot\" \"string lightgroup\" \"fill.light\"\n"
      "AreaLightSource \"diffuse\" \"string lightgroup\" \"the sun\" Shape \"sphere\"\n");
  EXPECT_EQ(r.scene.lights.at(0).light_group, "key_light");
  EXPECT_EQ(r.scene.lights.at(1).light_group, "fill_light");
  EXPECT_EQ(r.scene.area_lights.at(0).light_group, "the_sun");
  ASSERT_EQ(r.problems.size(), 1u) << listed(r);
  EXPECT_TRUE(mentions(r, "scene.pbrt:2:21: ")) << listed(r);
  EXPECT_TRUE(mentions(r, "\"key light\" gets the name \"key_light\"")) << listed(r);
  EXPECT_TRUE(mentions(r, "and 2 more like it")) << listed(r);
}

TEST_F(Lights, GroupsThatAreNoNamesAreNamed) {
  const LoadResult number = load("WorldBegin\nLightSource \"point\" \"float lightgroup\" 3\n");
  EXPECT_TRUE(mentions(number, "scene.pbrt:2:21: ")) << listed(number);
  EXPECT_TRUE(mentions(number, "\"lightgroup\" of light \"point\"")) << listed(number);
  const LoadResult two = load("WorldBegin\nLightSource \"point\" \"string lightgroup\" [\"a\" \"b\"]\n");
  EXPECT_TRUE(mentions(two, "needs one string, not 2; the first is taken")) << listed(two);
  EXPECT_EQ(two.scene.lights.at(0).light_group, "a");
}

}  // namespace
}  // namespace lightmill
