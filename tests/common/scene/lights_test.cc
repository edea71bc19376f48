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
    const LoadResult r = load("WorldBegin\nLightSource " + std::string(text));
    EXPECT_TRUE(has_error(r, "scene.pbrt:2:")) << text;
  }
}

TEST_F(Lights, NamesWhatIsLeftOut) {
  for (const char* type : {"goniometric", "projection"}) {
    const LoadResult r =
        load_world("LightSource \"" + std::string(type) + "\" \"string filename\" \"x.exr\"");
    EXPECT_TRUE(r.ok());
    EXPECT_TRUE(mentions(r, "scene.pbrt:2:1: ")) << listed(r);
    EXPECT_TRUE(mentions(r, "is left out")) << listed(r);
  }
}

}  // namespace
}  // namespace lightmill
