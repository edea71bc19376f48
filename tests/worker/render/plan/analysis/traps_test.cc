// Scenes whose plan is easily got wrong: what is needed is hidden, or what is there is not needed.
#include <gmock/gmock.h>

#include <complex>
#include <cstring>

#include "common/base/error.h"
#include "common/job/features.h"
#include "tests/common/scene/scene_fixture.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/plan/pilot.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

using ::testing::HasSubstr;

constexpr Features kExactly = kAllFeatures & ~kAllStrategies;

PlanItem item_of(const SceneDescription& scene, const std::string& feature,
                 Integrator integrator = Integrator::kPt) {
  const Renderer renderer(scene, settings_for(scene, integrator, 4, 5), 1);
  for (const PlanItem& item : renderer.plan().items) {
    if (item.feature == feature) return item;
  }
  ADD_FAILURE() << "no item " << feature;
  return {};
}
bool needs(const SceneDescription& scene, const std::string& feature) {
  return item_of(scene, feature).needed;
}

Partial render_layers(const SceneDescription& scene, Integrator integrator, Features overrides = 0) {
  RenderSettings settings = settings_for(scene, integrator, 2, 5);
  settings.overrides = overrides;
  return render_partial(scene, settings);
}
bool equal_layers(const Partial& a, const Partial& b) { return a.camera == b.camera && a.splats == b.splats; }

/// What the plan left out does nothing.
void expect_same_bits(const SceneDescription& scene) {
  for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt})
    EXPECT_TRUE(equal_layers(render_layers(scene, integrator), render_layers(scene, integrator, kExactly)))
        << name_of(integrator);
}

PilotReport pilot_of(const SceneDescription& scene) {
  return run_pilot(Renderer(scene, settings_for(scene, Integrator::kBdpt, 16, 5), 1), 1, [] { return true; });
}

/// Mean of the image under bdpt, pt, and the plan that a pilot chooses.
std::vector<Estimate> means(const SceneDescription& scene, const PixelRect& rect) {
  std::vector<Estimate> result;
  RenderSettings settings = settings_for(scene, Integrator::kBdpt, 256, 5);
  result.push_back(render_batches(scene, settings, 16).mean(rect));
  settings = settings_for(scene, Integrator::kPt, 256, 5, 2);
  result.push_back(render_batches(scene, settings, 16).mean(rect));
  settings = settings_for(scene, Integrator::kBdpt, 256, 5, 3);
  settings.plan = pilot_of(scene).chosen;
  result.push_back(render_batches(scene, settings, 16).mean(rect));
  return result;
}

class PlanTraps : public SceneTest {
 protected:
  /// A floor, a lamp (one sphere), a camera; `body` is what makes the trap.
  SceneDescription scene(const std::string& body, const std::string& lamp = kLamp) {
    return clean(load(R"(LookAt 0 1 -4  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 24 "integer yresolution" 24
WorldBegin
Material "diffuse"
Shape "bilinearmesh" "point3 P" [-3 0 -3  3 0 -3  -3 0 3  3 0 3]
)" + lamp + body));
  }
  /// A grey image of 2 x 2 texels.
  void write_image(const std::string& name) {
    const float texels[] = {0, 1, 1, 0};
    std::string bytes(sizeof texels, '\0');
    std::memcpy(bytes.data(), texels, sizeof texels);
    folder_.write(name, "Pf\n2 2\n-1.0\n" + bytes);
  }
  static constexpr const char* kLamp = R"(AttributeBegin
AreaLightSource "diffuse" "rgb L" [8 8 8]
Translate 0 3 0
Shape "sphere" "float radius" 0.4
AttributeEnd
)";
  static constexpr const char* kBoard =
      R"(Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point2 uv" [0 0 1 0 1 1 0 1]
"point3 P" [-1 0 0 1 0 0 1 1.5 0 -1 1.5 0])";
};

TEST_F(PlanTraps, TextureInAnAlphaMaskAlone) {
  write_image("mask.pfm");
  const std::string texture = "Texture \"m\" \"float\" \"imagemap\" \"string filename\" \"mask.pfm\"\n";
  const SceneDescription masked = scene(texture + kBoard + " \"texture alpha\" \"m\"\n");
  EXPECT_EQ(item_of(masked, "textures").reason, "alpha masks alone read one");
  for (const char* feature : {"textures", "texture coordinates", "alpha masks", "acceleration tree"})
    EXPECT_TRUE(needs(masked, feature)) << feature;
  expect_same_bits(masked);
  EXPECT_FALSE(
      equal_layers(render_layers(masked, Integrator::kPt), render_layers(scene(kBoard), Integrator::kPt)))
      << "the mask shows";
}

TEST_F(PlanTraps, TextureInABumpMapAlone) {
  write_image("bumps.pfm");
  const SceneDescription bumpy = scene(
      "Texture \"m\" \"float\" \"imagemap\" \"string filename\" \"bumps.pfm\"\n"
      "Material \"diffuse\" \"texture displacement\" \"m\"\n" +
      std::string(kBoard));
  EXPECT_EQ(item_of(bumpy, "textures").reason, "normal and bump maps alone read one");
  for (const char* feature : {"textures", "texture coordinates", "normal and bump maps"})
    EXPECT_TRUE(needs(bumpy, feature)) << feature;
  expect_same_bits(bumpy);
  EXPECT_FALSE(
      equal_layers(render_layers(bumpy, Integrator::kPt), render_layers(scene(kBoard), Integrator::kPt)))
      << "the bumps show";
}

// Neither read nor needed: the image could not even be opened.
TEST_F(PlanTraps, TexturesOfMaterialsThatNothingIsMadeOf) {
  folder_.write("broken.pfm", "not an image");
  const std::string texture = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"broken.pfm\"\n";
  const std::string named =
      "MakeNamedMaterial \"u\" \"string type\" \"diffuse\" \"texture reflectance\" \"t\"\n";
  const std::string mixed =
      named +
      "MakeNamedMaterial \"v\" \"string type\" \"mix\" \"string materials\" [\"u\" \"u\"]\n"
      "ObjectBegin \"never placed\"\nNamedMaterial \"v\"\n" +
      kBoard + "\nObjectEnd\nMaterial \"diffuse\"\n";
  const SceneDescription plain = scene(kBoard);
  for (const std::string& body : {texture, texture + named, texture + mixed}) {
    const SceneDescription unused = scene(body + kBoard);
    for (const char* feature : {"textures", "texture coordinates", "mixes", "material sort"})
      EXPECT_FALSE(needs(unused, feature)) << feature << body;
    EXPECT_EQ(item_of(unused, "textures").reason,
              "nothing in use reads one, and 1 image(s) that nothing in use reads are not loaded");
    EXPECT_TRUE(
        equal_layers(render_layers(unused, Integrator::kBdpt), render_layers(plain, Integrator::kBdpt)));
  }
  // In use it is read, through a mix and a scale, and said to be broken.
  const std::string scaled =
      texture +
      "Texture \"s\" \"spectrum\" \"scale\" \"texture tex\" \"t\" \"float scale\" 0.5\n"
      "MakeNamedMaterial \"u\" \"string type\" \"diffuse\" \"texture reflectance\" \"s\"\n"
      "MakeNamedMaterial \"v\" \"string type\" \"mix\" \"string materials\" [\"u\" \"u\"]\n"
      "NamedMaterial \"v\"\n";
  EXPECT_THROW(needs(scene(scaled + kBoard), "textures"), Error);
}

TEST_F(PlanTraps, LightsWithoutPower) {
  const std::string dark = R"(LightSource "point" "rgb I" [0 0 0]
LightSource "distant" "rgb L" [0 0 0]
LightSource "infinite" "rgb L" [0 0 0]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [0 0 0]
Translate 0 2 0
Shape "sphere" "float radius" 0.1
AttributeEnd
)";
  const SceneDescription lit = scene(dark);
  for (const char* feature : {"light selection", "light tree", "delta lights", "environment"})
    EXPECT_FALSE(needs(lit, feature)) << feature;
  expect_same_bits(lit);
  // Only a point light has power: no path ends on an emitter.
  const PilotReport report = pilot_of(scene(dark, "LightSource \"point\" \"point3 from\" [1 2 -1]\n"));
  ASSERT_FALSE(report.estimates.empty());
  for (const PlanEstimate& e : report.estimates)
    EXPECT_FALSE(e.plan.strategies & kEmissionHits) << plan_to_json(e.plan);
  // None has: a black picture, not an error.
  const SceneDescription night = scene(dark, "");
  EXPECT_NO_THROW(check_plan(pilot_of(night).chosen));
  EXPECT_EQ(render_batches(night, settings_for(night, Integrator::kBdpt, 16, 5), 1).mean().mean, 0);
}

TEST_F(PlanTraps, MediumThatNobodyIsIn) {
  const std::string fog =
      "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [1 1 1] \"rgb sigma_a\" [1 1 "
      "1]\n";
  const SceneDescription with = scene(fog + kBoard), without = scene(kBoard);
  EXPECT_FALSE(needs(with, "participating media"));
  for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt})
    EXPECT_TRUE(equal_layers(render_layers(with, integrator), render_layers(without, integrator)))
        << name_of(integrator);
}

TEST(PlanTrapScenes, OneEmissiveTriangleAmongAMillion) {
  TestScene s;
  auto mesh = std::make_shared<TriangleMesh>();
  constexpr uint32_t kSide = 708;  // 2 * 708^2 triangles
  for (uint32_t y = 0; y <= kSide; ++y) {
    for (uint32_t x = 0; x <= kSide; ++x)
      mesh->positions.push_back({-3 + 6 * static_cast<float>(x) / kSide,
                                 static_cast<float>((x * 7 + y * 5) % 3) * 1e-3f,
                                 -3 + 6 * static_cast<float>(y) / kSide});
  }
  for (uint32_t y = 0; y < kSide; ++y) {
    for (uint32_t x = 0; x < kSide; ++x) {
      const uint32_t v = y * (kSide + 1) + x, up = v + kSide + 1;
      mesh->triangles.push_back({v, up, v + 1});
      mesh->triangles.push_back({v + 1, up, up + 1});
    }
  }
  ASSERT_GT(mesh->triangles.size(), 1000000u);
  ShapeDescription floor;
  floor.kind = MeshShape{mesh};
  floor.material = s.diffuse(0.5f);
  s.scene.shapes.push_back(floor);
  // Above the camera, out of its sight.
  s.triangle({0.5, 4, -3}, {0.5, 4, -2.99}, {0.51, 4, -3}, floor.material,
             {.radiance = {1e5f, 1e5f, 1e5f}, .two_sided = true});
  s.camera({0, 3, -5}, {0, 0, 0}, 40).film(24, 24);
  EXPECT_FALSE(needs(s.scene, "light selection"));
  EXPECT_EQ(item_of(s.scene, "light selection").reason, "1 light(s)");
  const std::vector<Estimate> m = means(s.scene, {0, 0, 24, 24});
  ASSERT_GT(m[0].mean, 0.01);
  for (const Estimate& e : m)
    EXPECT_NEAR(e.mean, m[0].mean, 5 * std::hypot(e.standard_error, m[0].standard_error));
}

/// Two mirrors like those of a periscope; the camera looks through them at what stands behind a wall.
TestScene periscope() {
  TestScene s;
  const int grey = s.diffuse(0.5f), mirror = s.conductor(0.8f, 0);
  s.quad({-1, -1, 1}, {2, 0, 0}, {0, 2, 2}, mirror);  // 45 degrees: up
  s.quad({-1, 3, 1}, {2, 0, 0}, {0, 2, 2}, mirror);   // and on along +z
  s.quad({-4, -4, 4}, {8, 0, 0}, {0, 7, 0}, grey);    // the wall
  s.camera({0, 0, -3}, {0, 0, 1}, 10).film(16, 16);
  return s;
}

/// Fresnel's reflectance of TestScene::conductor(r, 0) at 45 degrees, by complex arithmetic.
double reflectance_at_45(double r) {
  const std::complex<double> eta(1, 2 * std::sqrt(r / (1 - r)));
  const double cosine = std::sqrt(0.5);
  const std::complex<double> inside = std::sqrt(1.0 - 0.5 / (eta * eta));
  return 0.5 * (std::norm((cosine - eta * inside) / (cosine + eta * inside)) +
                std::norm((eta * cosine - inside) / (eta * cosine + inside)));
}

TEST(PlanTrapScenes, LightSeenThroughTwoMirrorsOnly) {
  TestScene s = periscope();
  s.quad({-4, 0, 9}, {0, 8, 0}, {8, 0, 0}, s.diffuse(0.0f), {.radiance = {2, 2, 2}, .two_sided = true});
  EXPECT_TRUE(needs(s.scene, "delta events"));
  const double r = reflectance_at_45(0.8);
  // Some rays meet the mirrors at 43 or 47 degrees.
  for (const Estimate& e : means(s.scene, {4, 4, 12, 12}))
    EXPECT_NEAR(e.mean, 2 * r * r, 5 * e.standard_error + 5e-4);
}

TEST(PlanTrapScenes, MirrorSeenOnlyInAMirror) {
  // Behind the periscope a wall, lit by a lamp beside it that the camera does not see.
  TestScene s = periscope();
  s.quad({-4, 0, 9}, {0, 8, 0}, {8, 0, 0}, s.diffuse(0.7f));
  s.sphere({3, 6, 7}, 0.4, s.diffuse(0.0f), {.radiance = {20, 20, 20}});
  EXPECT_TRUE(needs(s.scene, "delta events"));
  expect_same_bits(s.scene);
  const std::vector<Estimate> m = means(s.scene, {4, 4, 12, 12});
  ASSERT_GT(m[0].mean, 0.01);
  for (const Estimate& e : m)
    EXPECT_NEAR(e.mean, m[0].mean, 5 * std::hypot(e.standard_error, m[0].standard_error));
}

TEST(PlanTrapScenes, DeltaLightInsideGlass) {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
  s.sphere({0, 1, 0}, 0.3, s.dielectric(1.5f, 0));
  s.point_light({0.05, 1, 0}, {6, 6, 6}).camera({0, 3, -5}, {0, 0, 0}, 40).film(24, 24);
  for (const char* feature : {"delta events", "delta lights"})
    EXPECT_TRUE(needs(s.scene, feature)) << feature;
  const PilotReport report = pilot_of(s.scene);
  for (const PlanEstimate& e : report.estimates)
    EXPECT_EQ(e.plan.strategies, kNextEvent | kLightPaths) << plan_to_json(e.plan);
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 256, 5);
  const Estimate all = render_batches(s.scene, settings, 16).mean();
  settings.plan = report.chosen;
  settings.seed = 2;
  const Estimate chosen = render_batches(s.scene, settings, 16).mean();
  ASSERT_GT(all.mean, 0.05);
  EXPECT_NEAR(chosen.mean, all.mean, 5 * std::hypot(all.standard_error, chosen.standard_error));
}

// What an integrator can't find it says, and only then.
TEST(PlanTrapScenes, LightThatIsLeftOutIsNamed) {
  enum Lamp { kPoint, kSphere };
  const auto lost = [](Lamp lamp, bool glass, Integrator integrator, int max_depth = 5) {
    TestScene s;
    s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
    if (glass) s.sphere({0, 1, 0}, 0.3, s.dielectric(1.5f, 0));
    if (lamp == kPoint) {
      s.point_light({0, 3, 0}, {6, 6, 6});
    } else {
      s.sphere({0, 3, 0}, 0.05, s.diffuse(0.0f), {.radiance = {900, 900, 900}});
    }
    s.camera({0, 3, -5}, {0, 0, 0}, 40).film(8, 8);
    return Renderer(s.scene, settings_for(s.scene, integrator, 4, max_depth), 1).plan().lost_light;
  };
  EXPECT_THAT(lost(kPoint, true, Integrator::kPt),
              HasSubstr("pt leaves out light of paths LSDE from lights at"));
  EXPECT_THAT(lost(kPoint, true, Integrator::kLt),
              HasSubstr("lt leaves out light of paths LDSE from lights at"));
  EXPECT_THAT(lost(kSphere, true, Integrator::kLt), HasSubstr("lt leaves out light of paths LSE ("));
  EXPECT_EQ(lost(kPoint, true, Integrator::kPt, 1), "") << "two events are more than it may take";
  EXPECT_EQ(lost(kSphere, true, Integrator::kPt), "");
  for (const Lamp lamp : {kPoint, kSphere}) {
    EXPECT_EQ(lost(lamp, true, Integrator::kBdpt), "");
    EXPECT_EQ(lost(lamp, true, Integrator::kAuto), "");
    for (const Integrator one : {Integrator::kPt, Integrator::kLt}) EXPECT_EQ(lost(lamp, false, one), "");
  }
}

// The pilot's paths all miss the ball; what it does to the light must be in reach of every plan all the same.
TEST(PlanTrapScenes, CausticTooSmallForThePilot) {
  enum Lamp { kSphere, kPoint, kUnseen };
  for (const Lamp lamp : {kSphere, kPoint, kUnseen}) {
    TestScene s;
    s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
    s.sphere({0, 1e-3, 0}, 1e-4, s.dielectric(1.5f, 0));
    if (lamp == kPoint) {
      s.point_light({0, 3, 0}, {10, 10, 10});
    } else {
      s.sphere({0, 3, 0}, 0.05, s.diffuse(0.0f), {.radiance = {900, 900, 900}});
    }
    // Rays pass it by, so that nothing ends on it.
    if (lamp == kUnseen) s.scene.shapes.back().alpha = {0, -1};
    s.camera({0, 6, 0.01}, {0, 0, 0}, 60).film(24, 24);
    const PilotReport report = pilot_of(s.scene);
    ASSERT_FALSE(report.estimates.empty());
    const Strategies sees_it = lamp == kSphere ? kEmissionHits : kLightPaths;
    for (const PlanEstimate& e : report.estimates)
      EXPECT_EQ(e.plan.strategies & sees_it, sees_it) << plan_to_json(e.plan);
  }
}

}  // namespace
}  // namespace lightmill::test
