// Scenes that say plain things in a roundabout way: the plan is that of the plain scene, and so are the bits.
#include <gtest/gtest.h>

#include <set>

#include "tests/common/scene/scene_fixture.h"
#include "tests/support/render.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

class Roundabout : public SceneTest {
 protected:
  /// A floor, a lamp, a camera, and what `body` adds.
  SceneDescription scene(const std::string& body) {
    return clean(load(R"(LookAt 0 1 -4  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 24 "integer yresolution" 24
WorldBegin
AttributeBegin
AreaLightSource "diffuse" "rgb L" [8 8 8]
Shape "trianglemesh" "integer indices" [0 1 2] "point3 P" [-1 3 -1 1 3 -1 0 3 1]
AttributeEnd
Material "diffuse"
Shape "bilinearmesh" "point3 P" [-3 0 -3  3 0 -3  -3 0 3  3 0 3]
)" + body));
  }
  /// What the plan keeps.
  static std::set<std::string> needed(const SceneDescription& scene) {
    std::set<std::string> names;
    const Renderer renderer(scene, settings_for(scene, Integrator::kBdpt, 4, 5), 1);
    for (const PlanItem& item : renderer.plan().items) {
      if (item.needed) names.insert(item.feature);
    }
    return names;
  }
  /// `body` needs what `plain` needs, and gives the same bits.
  void expect_plain(const std::string& body, const std::string& plain) {
    const SceneDescription a = scene(body + kBoard), b = scene(plain + kBoard);
    EXPECT_EQ(needed(a), needed(b)) << body;
    for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
      const Partial x = render_partial(a, settings_for(a, integrator, 2, 5)),
                    y = render_partial(b, settings_for(b, integrator, 2, 5));
      EXPECT_TRUE(x.camera == y.camera && x.splats == y.splats) << body << name_of(integrator);
    }
  }
  static constexpr const char* kBoard = R"(
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point2 uv" [0 0 1 0 1 1 0 1]
"point3 P" [-1 0 0 1 0 0 1 1.5 0 -1 1.5 0])";
};

TEST_F(Roundabout, TexturesOfOneValue) {
  const std::string plain = "Material \"diffuse\" \"rgb reflectance\" [0.25 0.5 0.75]";
  const std::string value = "Texture \"c\" \"spectrum\" \"constant\" \"rgb value\" [0.25 0.5 0.75]\n";
  expect_plain(value + "Material \"diffuse\" \"texture reflectance\" \"c\"", plain);
  expect_plain(
      value +
          "Texture \"t\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"c\" \"texture tex2\" \"c\"\n"
          "Material \"diffuse\" \"texture reflectance\" \"t\"",
      plain);
  expect_plain(
      "Texture \"h\" \"float\" \"constant\" \"float value\" 0.3\n"
      "Material \"diffuse\" \"rgb reflectance\" [0.25 0.5 0.75] \"texture displacement\" \"h\"",
      plain);
  expect_plain(
      "Texture \"r\" \"float\" \"constant\" \"float value\" 0.3\n"
      "Material \"conductor\" \"texture roughness\" \"r\"",
      "Material \"conductor\" \"float roughness\" 0.3");
}

TEST_F(Roundabout, MixesThatShowOnePart) {
  const std::string parts =
      "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"broken.png\"\n"
      "MakeNamedMaterial \"hidden\" \"string type\" \"coateddiffuse\" \"texture reflectance\" \"t\"\n"
      "MakeNamedMaterial \"seen\" \"string type\" \"diffuse\"\n";
  folder_.write("broken.png", "not an image");
  const std::string plain = "Material \"diffuse\"";
  expect_plain(parts + "Material \"mix\" \"string materials\" [\"seen\" \"hidden\"] \"float amount\" 0",
               plain);
  expect_plain(parts + "Material \"mix\" \"string materials\" [\"hidden\" \"seen\"] \"float amount\" 1",
               plain);
  expect_plain(parts + "Material \"mix\" \"string materials\" [\"seen\" \"seen\"] \"float amount\" 0.5",
               plain);
}

}  // namespace
}  // namespace lightmill::test
