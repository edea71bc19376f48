// Every directive of pbrt-v4, and the defaults of what is left out.
#include "common/scene/resolve_settings.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class Directives : public SceneTest {
 protected:
  /// Where the object-space origin of the i-th shape lies.
  static Vec3d origin(const SceneDescription& scene, size_t i) {
    return transform_point(scene.shapes.at(i).object_to_world, {0, 0, 0});
  }
  static void expect_origin(const SceneDescription& scene, size_t i, double x, double y, double z) {
    const Vec3d p = origin(scene, i);
    EXPECT_NEAR(p.x, x, 1e-12) << i;
    EXPECT_NEAR(p.y, y, 1e-12) << i;
    EXPECT_NEAR(p.z, z, 1e-12) << i;
  }
};

TEST_F(Directives, Defaults) {
  const SceneDescription s = clean(load("WorldBegin LightSource \"point\""));
  EXPECT_EQ(s.film.width, 1280);
  EXPECT_EQ(s.film.height, 720);
  EXPECT_EQ(s.film.imaging_ratio, 1);
  EXPECT_EQ(s.sampling.spp, 16);
  EXPECT_EQ(s.sampling.max_depth, 5);
  EXPECT_EQ(s.sampling.seed, 0u);
  EXPECT_EQ(s.filter.kind, FilterKind::kGaussian);
  EXPECT_EQ(s.filter.xradius, 1.5);
  EXPECT_EQ(s.filter.sigma, 0.5);
  EXPECT_EQ(s.camera.fov_degrees, 90);
  EXPECT_EQ(s.camera.lens_radius, 0);
}

TEST_F(Directives, OrthographicCamera) {
  const SceneDescription s = clean(
      load("Camera \"orthographic\" \"float screenwindow\" [-3 3 -2 2] WorldBegin LightSource \"point\""));
  EXPECT_EQ(s.camera.kind, CameraKind::kOrthographic);
  EXPECT_EQ(s.camera.screen_window->at(1), 3);
  EXPECT_EQ(s.camera.lens_radius, 0);
  const LoadResult lens = load(
      "Camera \"orthographic\" \"float lensradius\" 0.1 \"float focaldistance\" 3 WorldBegin "
      "LightSource \"point\"");
  EXPECT_TRUE(lens.ok() && mentions(lens, "stays orthographic")) << listed(lens);
  EXPECT_EQ(lens.scene.camera.lens_radius, 0.1);
  EXPECT_EQ(lens.scene.camera.focal_distance, 3);
}

TEST_F(Directives, SphericalCamera) {
  const auto camera = [&](const std::string& parameters) {
    return clean(load("Camera \"spherical\" " + parameters + " WorldBegin LightSource \"point\"")).camera;
  };
  EXPECT_EQ(camera("").kind, CameraKind::kSpherical);
  EXPECT_EQ(camera("").mapping, SphericalMapping::kEqualArea);
  EXPECT_EQ(camera("\"string mapping\" \"equirectangular\"").mapping, SphericalMapping::kEquirectangular);
}

TEST_F(Directives, Options) {
  const SceneDescription s = clean(load(R"(
    Option "integer seed" 3
    ColorSpace "srgb"
    Scale -1 1 1
    LookAt 0 0 5  0 0 0  0 1 0
    Camera "perspective" "float fov" 40 "float screenwindow" [-1 1 -2 2] "float frameaspectratio" 2
      "float lensradius" 0.1 "float focaldistance" 3
    Film "rgb" "integer xresolution" 20 "integer yresolution" 30 "string filename" "o.png"
      "float cropwindow" [0 0.5 0.25 1] "float iso" 200 "float diagonal" 35 "bool savefp16" false
    PixelFilter "triangle"
    Sampler "halton" "integer pixelsamples" 7 "integer seed" 9
    Integrator "volpath" "integer maxdepth" 11 "string lightsampler" "power"
    Accelerator "bvh" "string splitmethod" "sah"
    WorldBegin
    LightSource "point")"));
  EXPECT_EQ(s.camera.fov_degrees, 40);
  EXPECT_EQ(s.camera.screen_window->at(2), -2);
  EXPECT_EQ(*s.camera.frame_aspect_ratio, 2);
  EXPECT_EQ(s.camera.lens_radius, 0.1);
  EXPECT_EQ(s.camera.focal_distance, 3);
  const Vec3d eye = transform_point(s.camera.camera_to_world, {0, 0, 0});
  EXPECT_NEAR(eye.z, 5, 1e-12);
  EXPECT_NEAR(transform_vector(s.camera.camera_to_world, {1, 0, 0}).x, 1, 1e-12)
      << "the Scale undoes the mirror";
  EXPECT_EQ(s.film.width, 20);
  EXPECT_EQ(s.film.height, 30);
  EXPECT_EQ(s.film.filename, "o.png");
  EXPECT_EQ(s.film.crop->at(2), 0.25);
  EXPECT_EQ(s.film.imaging_ratio, 2);
  EXPECT_EQ(s.filter.kind, FilterKind::kTriangle);
  EXPECT_EQ(s.filter.xradius, 2);
  EXPECT_EQ(s.sampling.spp, 7);
  EXPECT_EQ(s.sampling.seed, 9u);
  EXPECT_EQ(s.sampling.max_depth, 11);
  EXPECT_EQ(s.sampling.integrator, "volpath");
}

TEST_F(Directives, ShutterIsAnExposureTime) {
  const SceneDescription s =
      clean(load("Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 3 WorldBegin "
                 "LightSource \"point\""));
  EXPECT_EQ(s.film.imaging_ratio, 2);
}

TEST_F(Directives, ShuttersMayOpenSlowly) {
  const auto openness = [&](const std::string& values) {
    return load("Camera \"perspective\" \"float shuttercurve\" [" + values +
                "] WorldBegin LightSource \"point\"");
  };
  EXPECT_EQ(clean(openness("0 1 .5")).shutter.openness, (std::vector<double>{0, 1, 0.5}));
  for (const char* bad : {"1", "0 0", "0 -1", ""})
    EXPECT_TRUE(openness(bad).scene.shutter.openness.empty()) << bad;
}

TEST_F(Directives, PixelBoundsBecomeACrop) {
  const SceneDescription s =
      clean(load("Film \"rgb\" \"integer xresolution\" 300 \"integer yresolution\" 700 \"integer "
                 "pixelbounds\" [7 90 3 699] WorldBegin LightSource \"point\""));
  EXPECT_EQ(resolve_settings(s, {}).grid.crop, (PixelRect{7, 3, 90, 699}));
}

TEST_F(Directives, StratifiedSamplesMultiply) {
  const SceneDescription s =
      clean(load("Sampler \"stratified\" \"integer xsamples\" 3 \"integer ysamples\" 5 WorldBegin "
                 "LightSource \"point\""));
  EXPECT_EQ(s.sampling.spp, 15);
}

TEST_F(Directives, FilterDefaults) {
  EXPECT_EQ(clean(load("PixelFilter \"box\" WorldBegin LightSource \"point\"")).filter.xradius, 0.5);
  EXPECT_EQ(clean(load("PixelFilter \"gaussian\" \"float sigma\" 0.7 WorldBegin LightSource \"point\""))
                .filter.sigma,
            0.7);
}

TEST_F(Directives, ARepeatedOptionReplacesTheFirst) {
  const LoadResult r = load(
      "Sampler \"sobol\" \"integer pixelsamples\" 4\nSampler \"sobol\" WorldBegin LightSource \"point\"");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "scene.pbrt:2:1: warning: Sampler is given again"));
  EXPECT_EQ(r.scene.sampling.spp, 16);
}

TEST_F(Directives, TransformsCompose) {
  const SceneDescription s = clean_world(R"(
    Translate 1 0 0 Scale 2 2 2 Translate 1 0 0 Shape "sphere"
    Identity Rotate 90 0 0 1 Translate 1 0 0 Shape "sphere"
    Transform [1 0 0 0  0 1 0 0  0 0 1 0  4 5 6 1] Shape "sphere"
    ConcatTransform [1 0 0 0  0 1 0 0  0 0 1 0  1 1 1 1] Shape "sphere"
    Identity LookAt 0 0 -5  0 0 0  0 1 0 Shape "sphere")");
  expect_origin(s, 0, 3, 0, 0);
  expect_origin(s, 1, 0, 1, 0);
  expect_origin(s, 2, 4, 5, 6);
  expect_origin(s, 3, 5, 6, 7);
  expect_origin(s, 4, 0, 0, 5);
}

TEST_F(Directives, WorldBeginResetsTheTransform) {
  const SceneDescription s = clean(
      load("Translate 5 0 0 Camera \"perspective\" WorldBegin LightSource \"point\" Shape \"sphere\" "
           "CoordSysTransform \"camera\" Shape \"sphere\" CoordSysTransform \"world\" Shape \"sphere\""));
  expect_origin(s, 0, 0, 0, 0);
  expect_origin(s, 1, -5, 0, 0);
  expect_origin(s, 2, 0, 0, 0);
}

TEST_F(Directives, NamedCoordinateSystems) {
  const SceneDescription s = clean_world(
      "Translate 3 0 0 CoordinateSystem \"here\" Identity Shape \"sphere\" CoordSysTransform \"here\" Shape "
      "\"sphere\"");
  expect_origin(s, 0, 0, 0, 0);
  expect_origin(s, 1, 3, 0, 0);
}

TEST_F(Directives, AttributeScopesRestoreEverything) {
  const SceneDescription s = clean_world(R"(
    Material "diffuse" "rgb reflectance" [0.1 0.1 0.1]
    AttributeBegin
      Translate 1 0 0
      ReverseOrientation
      Material "dielectric"
      AreaLightSource "diffuse" "rgb L" [2 2 2] "float scale" 3 "bool twosided" true
      Shape "sphere"
    AttributeEnd
    Shape "sphere")");
  ASSERT_EQ(s.shapes.size(), 2u);
  expect_origin(s, 0, 1, 0, 0);
  EXPECT_TRUE(s.shapes[0].reverse_orientation);
  EXPECT_TRUE(std::holds_alternative<DielectricMaterial>(
      s.materials.at(static_cast<size_t>(s.shapes[0].material)).kind));
  ASSERT_EQ(s.shapes[0].area_light, 0);
  EXPECT_EQ(s.area_lights[0].radiance, (Rgb{6, 6, 6}));
  EXPECT_TRUE(s.area_lights[0].two_sided);
  expect_origin(s, 1, 0, 0, 0);
  EXPECT_FALSE(s.shapes[1].reverse_orientation);
  EXPECT_EQ(s.shapes[1].area_light, -1);
  EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(
      s.materials.at(static_cast<size_t>(s.shapes[1].material)).kind));
}

TEST_F(Directives, TransformScopeRestoresOnlyTheTransform) {
  const SceneDescription s =
      clean_world("TransformBegin Translate 1 0 0 ReverseOrientation TransformEnd Shape \"sphere\"");
  expect_origin(s, 0, 0, 0, 0);
  EXPECT_TRUE(s.shapes[0].reverse_orientation);
}

TEST_F(Directives, AttributeSetsDefaults) {
  const SceneDescription s = clean_world(R"(
    AttributeBegin
      Attribute "shape" "float radius" 2
      Attribute "material" "rgb reflectance" [0.2 0.2 0.2]
      Attribute "light" "float scale" 5
      Shape "sphere"
      Shape "sphere" "float radius" 3
      Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]
      Material "diffuse"
      LightSource "point"
    AttributeEnd
    Shape "sphere")");
  EXPECT_EQ(std::get<SphereShape>(s.shapes.at(0).kind).radius, 2);
  EXPECT_EQ(std::get<SphereShape>(s.shapes.at(1).kind).radius, 3);
  EXPECT_EQ(std::get<SphereShape>(s.shapes.at(3).kind).radius, 1);
  EXPECT_EQ(std::get<PointLight>(s.lights.at(1).kind).intensity, (Rgb{5, 5, 5}));
  EXPECT_FLOAT_EQ(std::get<DiffuseMaterial>(s.materials.at(1).kind).reflectance.value.r, 0.2f)
      << "after the default material";
}

TEST_F(Directives, NamesMayBeUsedBeforeTheyAreDefined) {
  const SceneDescription s = clean_world(R"(
    NamedMaterial "glass" Shape "sphere"
    MakeNamedMaterial "glass" "string type" "dielectric" "float eta" 1.3)");
  const auto& m = s.materials.at(static_cast<size_t>(s.shapes.at(0).material));
  EXPECT_EQ(m.name, "glass");
  EXPECT_FLOAT_EQ(std::get<DielectricMaterial>(m.kind).eta, 1.3f);
}

TEST_F(Directives, IncludeSharesTheStateAndImportDoesNot) {
  folder_.write("parts/moved.pbrt", "Translate 1 0 0 Shape \"sphere\"\n");
  const SceneDescription s = clean_world(
      "Import \"parts/moved.pbrt\" Shape \"sphere\" Include \"./parts/moved.pbrt\" Shape \"sphere\"");
  expect_origin(s, 0, 1, 0, 0);
  expect_origin(s, 1, 0, 0, 0);
  expect_origin(s, 2, 1, 0, 0);
  expect_origin(s, 3, 1, 0, 0);
  ASSERT_EQ(s.files.size(), 2u);
  EXPECT_EQ(s.files[0].name, "scene.pbrt");
  EXPECT_EQ(s.files[1].name, "parts/moved.pbrt");
}

TEST_F(Directives, InstancesShareTheirObject) {
  const SceneDescription s = clean_world(R"(
    Translate 0 0 3
    ObjectBegin "pair"
      Translate 0 1 0
      Shape "sphere"
      Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0]
    ObjectEnd
    ObjectBegin "unused" Shape "sphere" ObjectEnd
    Identity
    Shape "sphere"
    Translate 5 0 0
    ObjectInstance "pair"
    Scale 2 2 2
    ObjectInstance "pair")");
  EXPECT_EQ(s.shapes.size(), 1u);
  ASSERT_EQ(s.objects.size(), 2u);
  EXPECT_EQ(s.objects[0].name, "pair");
  ASSERT_EQ(s.objects[0].shapes.size(), 2u);
  const Vec3d in_object = transform_point(s.objects[0].shapes[0].object_to_world, {});
  EXPECT_EQ(in_object.y, 1);
  EXPECT_EQ(in_object.z, 3) << "the transform in force at ObjectBegin counts, as in pbrt";
  ASSERT_EQ(s.instances.size(), 2u);
  for (const size_t i : {size_t{0}, size_t{1}}) {
    EXPECT_EQ(s.instances[i].object, 0);
    const Vec3d p = transform_point(s.instances[i].object_to_world, in_object);
    const double scale = i == 0 ? 1 : 2;
    EXPECT_EQ(p.x, 5);
    EXPECT_EQ(p.y, scale);
    EXPECT_EQ(p.z, 3 * scale);
  }
}

TEST_F(Directives, ASphereThatAnInstanceStretchesIsAMeshOnce) {
  const SceneDescription s = clean_world(R"(
    ObjectBegin "round" Shape "sphere" ObjectEnd
    ObjectBegin "long" Shape "sphere" ObjectEnd
    ObjectInstance "round" ObjectInstance "long"
    Scale 2 2 2 ObjectInstance "round"
    Scale 1 1 2 ObjectInstance "long")");
  ASSERT_EQ(s.objects.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<SphereShape>(s.objects[0].shapes[0].kind));
  EXPECT_TRUE(std::holds_alternative<MeshShape>(s.objects[1].shapes[0].kind));
}

TEST_F(Directives, FlattenedSpaceMayHoldNothing) {
  const SceneDescription s = clean(load_world(R"(
    ObjectBegin "o" Shape "sphere" ObjectEnd
    AttributeBegin
      Scale 1 0 1
      Translate 1 2 3
      TransformBegin Identity Shape "sphere" TransformEnd
    AttributeEnd
    TransformBegin Transform [1 0 0 0 0 1 0 0 1 1 0 0 0 0 0 1] TransformEnd
    Translate 0 5 0 ObjectInstance "o")"));
  ASSERT_EQ(s.shapes.size(), 1u) << "the one where Identity undoes it";
  EXPECT_EQ(transform_point(s.shapes[0].object_to_world, {0, 0, 0}).y, 0);
  ASSERT_EQ(s.instances.size(), 1u);
  EXPECT_EQ(transform_point(s.instances[0].object_to_world, {0, 0, 0}).y, 5);
  for (const char* what : {"LightSource \"point\"", "Shape \"sphere\"", "Translate 1 0 0 Shape \"sphere\"",
                           "ObjectInstance \"o\""}) {
    const LoadResult r = load_world("ObjectBegin \"o\" Shape \"sphere\" ObjectEnd\nScale 1 0 1\n" +
                                    std::string(what) + " " + what);
    EXPECT_EQ(r.problems.size(), 1u) << listed(r);
    EXPECT_TRUE(mentions(r, "is singular: it flattens")) << listed(r);
    EXPECT_FALSE(r.ok()) << what;
  }
}

TEST_F(Directives, OptionsAsPbrtWritesThem) {
  const SceneDescription s = clean(load(R"(
    Option "msereferenceout" "o.txt" Option "wavefront" true Option "Disable-Pixel_Jitter" false
    Option "displacementedgescale" 1.5 Option "seed" 42
    WorldBegin LightSource "point")"));
  EXPECT_EQ(s.sampling.seed, 42u);
  EXPECT_TRUE(has_error(strictly("Option \"sed\" 3 WorldBegin"), "did you mean \"seed\"?"));
  EXPECT_TRUE(has_error(strictly("Option \"seed\" 1.5 WorldBegin"), "must be \"integer\""));
  EXPECT_TRUE(has_error(strictly("Option \"seed\" WorldBegin"), "has no value"));
  EXPECT_TRUE(has_error(strictly("Option \"seed\""), "has no value"));
}

TEST_F(Directives, AFileMayBeIncludedVeryOften) {
  folder_.write("leaf.pbrt", "ObjectInstance \"o\"\n");
  const auto fifty = [](const std::string& name) {
    std::string all;
    for (int i = 0; i < 50; ++i) all += "Include \"" + name + "\"\n";
    return all;
  };
  folder_.write("branch.pbrt", fifty("leaf.pbrt"));
  folder_.write("bough.pbrt", fifty("branch.pbrt"));
  const SceneDescription s =
      clean_world("ObjectBegin \"o\" Shape \"sphere\" ObjectEnd\n" + fifty("bough.pbrt").substr(0, 10 * 21));
  EXPECT_EQ(s.instances.size(), 25000u);
}

TEST_F(Directives, InstancesThatCannotBeAreRefusedWithTheirLine) {
  const std::string object = "ObjectBegin \"o\" Scale 1e20 1e20 1e20 Shape \"sphere\" ObjectEnd\n";
  const std::pair<const char*, const char*> cases[] = {
      {"Scale 1 0 1 ObjectInstance \"o\"", "is singular"},
      {"Transform [1 0 0 0 0 1 0 0 1 1 0 0 0 0 0 1] ObjectInstance \"o\"", "is singular"},
      {"Scale 1e19 1e19 1e19 ObjectInstance \"o\"", "lies outside the range of numbers"},
      {"ObjectInstance \"oo\"", "there is no object named \"oo\"; did you mean \"o\"?"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = load_world(object + text);
    EXPECT_TRUE(has_error(r, message));
    EXPECT_TRUE(mentions(r, "scene.pbrt:3:")) << listed(r);
  }
}

TEST_F(Directives, UnsupportedOnesAreNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {"ActiveTransform EndTime Translate 1 1 1 LightSource \"infinite\"", "a light of this kind that moves"},
      {"Texture \"t\" \"spectrum\" \"constant\" Material \"subsurface\" \"texture mfp\" \"t\" "
       "\"rgb reflectance\" [.5 .5 .5]",
       "of a body the reflectance alone may vary"},
      {"Material \"hair\" \"texture beta_m\" \"t\" Texture \"t\" \"float\" \"constant\"", "is taken as 0.3"},
      {"Material \"dielectric\" \"spectrum eta\" \"glass-BK7\"", "dispersion"},
      {"Material \"dielectric\" \"rgb eta\" [1.5 1.5 1.6]", "dispersion"},
      {"Texture \"t\" \"float\" \"constant\" Material \"coateddiffuse\" \"texture thickness\" \"t\"",
       "is taken as 0.01"},
      {"Texture \"t\" \"float\" \"constant\" Material \"coateddiffuse\" \"texture g\" \"t\"",
       "is taken as 0"},
      {"Texture \"t\" \"spectrum\" \"ptex\"", "replaced by the constant 0.5"},
      {"ObjectBegin \"o\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd", "does not emit"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult lax = load_world(text);
    EXPECT_TRUE(lax.ok()) << text << "\n" << listed(lax);
    EXPECT_TRUE(mentions(lax, message)) << text << "\n" << listed(lax);
    EXPECT_TRUE(mentions(lax, "scene.pbrt:2:")) << listed(lax);
    EXPECT_TRUE(mentions(lax, "not supported yet")) << listed(lax);
    EXPECT_FALSE(load_world(text, {.strict = true}).ok()) << text;
  }
}

TEST_F(Directives, AGbufferFilmAsksForLayers) {
  const std::string rest = " WorldBegin LightSource \"point\"";
  const LoadResult world = load("Film \"gbuffer\" \"string coordinatesystem\" \"world\"" + rest);
  EXPECT_EQ(aov_names(world.scene.film.aovs), "albedo,normal,position,variance");
  EXPECT_TRUE(mentions(world, "albedo,normal,position,variance and no others")) << listed(world);
  EXPECT_EQ(load("Film \"rgb\"" + rest).scene.film.aovs, 0u);
  EXPECT_TRUE(mentions(load("Film \"gbuffer\" \"string coordinatesystem\" \"screen\"" + rest),
                       "must be \"camera\" or \"world\""));
}

TEST_F(Directives, UnsupportedOptionsAreNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {"Film \"spectral\"", "rendered as \"rgb\""},
      {"Film \"gbuffer\"", "in world space, and no others"},
      {"Integrator \"path\" \"bool regularize\" true", "is ignored"},
      {"Option \"bool disablepixeljitter\" true", "is ignored"},
      {"Option \"disablepixeljitter\" true", "is ignored"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult lax = load(std::string(text) + " WorldBegin LightSource \"point\"");
    EXPECT_TRUE(lax.ok()) << listed(lax);
    EXPECT_TRUE(mentions(lax, message)) << text << "\n" << listed(lax);
  }
}

}  // namespace
}  // namespace lightmill
