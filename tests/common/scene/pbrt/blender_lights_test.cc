// Lamps, visibility and cameras of Blender in pbrt files (docs/blender-lights.md).
#include <cmath>

#include "common/scene/possible_strategies.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class BlenderLights : public SceneTest {
 protected:
  template <class Light>
  Light only(const std::string& text) {
    const SceneDescription s = clean(load("WorldBegin\nLightSource " + text));
    return std::get<Light>(s.lights.at(0).kind);
  }
  CameraDescription camera(const std::string& text) {
    return clean(load("Camera " + text + "\nWorldBegin\nLightSource \"point\"")).camera;
  }
  static constexpr char kTriangle[] =
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] ";
};

TEST_F(BlenderLights, AreaLamps) {
  const auto lamp = only<AreaLamp>(
      "\"area\" \"string shape\" \"ellipse\" \"float width\" 2 \"float height\" 3 \"float spread\" 40 "
      "\"rgb L\" [1 2 3] \"float scale\" 2");
  EXPECT_TRUE(lamp.ellipse);
  EXPECT_EQ(lamp.half_width, 1);
  EXPECT_EQ(lamp.half_height, 1.5);
  EXPECT_EQ(lamp.spread_degrees, 40);
  EXPECT_EQ(lamp.radiance, (Rgb{2, 4, 6}));
  EXPECT_TRUE(
      mentions(load_world("LightSource \"area\" \"string shape\" \"disk\""), "\"rectangle\" is taken"));
  EXPECT_TRUE(mentions(load_world("LightSource \"area\" \"float width\" 0"), "\"width\""));
}

TEST_F(BlenderLights, PointsAndSpotsWithARadius) {
  EXPECT_EQ(only<PointLight>("\"point\" \"float radius\" 0.5").radius, 0.5);
  const auto spot =
      only<SpotLight>("\"spot\" \"float coneangle\" 60 \"float blend\" 0.25 \"float radius\" 2");
  EXPECT_TRUE(spot.falls_as_cosine);
  EXPECT_EQ(spot.radius, 2);
  // The smoothstep begins at cos(60) + (1 - cos(60)) / 4.
  EXPECT_NEAR(std::cos(spot.falloff_start * M_PI / 180), 0.625, 1e-9);
  EXPECT_FALSE(only<SpotLight>("\"spot\"").falls_as_cosine);
  EXPECT_TRUE(
      mentions(load_world("LightSource \"spot\" \"float coneangle\" 120 \"float blend\" 0"), "90 is taken"));
}

TEST_F(BlenderLights, HiddenFromKindsOfRays) {
  const SceneDescription s = clean_world(std::string(kTriangle) + R"("string hidden" ["camera" "shadow"]
Attribute "shape" "string hidden" "glossy"
)" + kTriangle + R"(
ObjectBegin "o"
Shape "sphere"
ObjectEnd
ObjectInstance "o" "string hidden" ["diffuse" "transmission" "volume_scatter"]
ObjectInstance "o"
LightSource "infinite" "string hidden" "camera"
)");
  EXPECT_EQ(s.shapes.at(0).hidden, kCameraRays | kShadowRays);
  EXPECT_EQ(s.shapes.at(1).hidden, kGlossyRays);
  EXPECT_EQ(s.objects.at(0).shapes.at(0).hidden, kGlossyRays);
  EXPECT_EQ(s.instances.at(0).hidden, kDiffuseRays | kTransmissionRays | kVolumeRays);
  EXPECT_EQ(s.instances.at(1).hidden, kGlossyRays) << "an Attribute is for instances, too";
  EXPECT_EQ(s.lights.at(1).hidden, kCameraRays);
  EXPECT_TRUE(
      mentions(load_world("Shape \"sphere\" \"string hidden\" \"camera rays\""), "not \"camera rays\""));
}

TEST_F(BlenderLights, OnlyTheCameraGoesWithLightPaths) {
  const auto strategies = [&](const std::string& body) { return possible_strategies(clean_world(body)).set; };
  constexpr Strategies kCameraPaths = kAllStrategies & ~kLightPaths;
  EXPECT_EQ(strategies("Shape \"sphere\" \"string hidden\" \"camera\""), kAllStrategies);
  EXPECT_EQ(strategies("LightSource \"infinite\" \"string hidden\" [\"diffuse\" \"glossy\" \"transmission\" "
                       "\"volume_scatter\" \"shadow\"]"),
            kAllStrategies)
      << "a background";
  EXPECT_EQ(strategies("Shape \"sphere\" \"string hidden\" \"shadow\""), kCameraPaths);
  EXPECT_EQ(strategies("Shape \"sphere\" \"string hidden\" \"glossy\""), kCameraPaths);
  EXPECT_EQ(strategies("LightSource \"infinite\" \"string hidden\" \"diffuse\""), kCameraPaths);
}

TEST_F(BlenderLights, EmissionByATexture) {
  const SceneDescription s =
      clean_world(std::string(R"(Texture "t" "spectrum" "checkerboard" "rgb tex1" [5 5 5]
AreaLightSource "diffuse" "texture L" "t" "float scale" 2
)") + kTriangle);
  const AreaLightDescription& light = s.area_lights.at(static_cast<size_t>(s.shapes.at(0).area_light));
  EXPECT_EQ(light.radiance, (Rgb{2, 2, 2}));
  EXPECT_TRUE(
      std::holds_alternative<CheckerboardTexture>(s.textures.at(static_cast<size_t>(light.texture)).kind));
}

TEST_F(BlenderLights, ThePanoramaOfAWorld) {
  folder_.write("sky.exr", "");
  const auto sky = only<InfiniteLight>(
      "\"infinite\" \"string filename\" \"sky.exr\" \"string mapping\" \"equirectangular\"");
  EXPECT_TRUE(sky.lat_long);
  // The middle of a panorama is -x of its space, right of that is -z, its top +y: here +x, -y and +z.
  const Vec3d middle = transform_vector(sky.light_to_world, {-1, 0, 0}),
              right = transform_vector(sky.light_to_world, {0, 0, -1}),
              top = transform_vector(sky.light_to_world, {0, 1, 0});
  EXPECT_EQ(middle.x, 1);
  EXPECT_EQ(right.y, -1);
  EXPECT_EQ(top.z, 1);
  EXPECT_FALSE(only<InfiniteLight>("\"infinite\" \"string filename\" \"sky.exr\"").lat_long);
}

TEST_F(BlenderLights, Cameras) {
  const CameraDescription fisheye = camera(
      "\"fisheye\" \"string projection\" \"equisolid\" \"float fov\" 170 \"float lens\" 8 \"float "
      "sensorwidth\" 30");
  EXPECT_EQ(fisheye.kind, CameraKind::kFisheye);
  EXPECT_EQ(fisheye.fisheye.projection, FisheyeProjection::kEquisolid);
  EXPECT_EQ(fisheye.fisheye.fov_degrees, 170);
  EXPECT_EQ(fisheye.fisheye.focal_length, 8);
  EXPECT_EQ(fisheye.fisheye.sensor_width, 30);
  const CameraDescription part =
      camera("\"spherical\" \"string mapping\" \"equirectangular\" \"float longitudemin\" -50");
  ASSERT_TRUE(part.range);
  EXPECT_EQ(part.range->longitude_min, -50);
  EXPECT_EQ(part.range->latitude_max, 90);
  EXPECT_FALSE(camera("\"spherical\" \"string mapping\" \"equirectangular\"").range);
  const CameraDescription blades = camera(
      "\"perspective\" \"float lensradius\" 0.1 \"integer blades\" 5 \"float bladerotation\" 10 \"float "
      "apertureratio\" 2");
  EXPECT_EQ(blades.blades.count, 5);
  EXPECT_EQ(blades.blades.rotation_degrees, 10);
  EXPECT_EQ(blades.blades.ratio, 2);
  const auto odd = [&](const std::string& text) {
    return load("Camera " + text + "\nWorldBegin\nLightSource \"point\"");
  };
  EXPECT_TRUE(mentions(odd("\"fisheye\" \"string projection\" \"round\""), "\"equidistant\" is taken"));
  EXPECT_TRUE(mentions(odd("\"spherical\" \"float longitudemin\" 0"), "left out"));
  EXPECT_TRUE(mentions(odd("\"spherical\" \"string mapping\" \"equirectangular\" \"float longitudemin\" 10 "
                           "\"float longitudemax\" 5"),
                       "the whole one is taken"));
}

}  // namespace
}  // namespace lightmill
