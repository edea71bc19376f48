// Broken scene files: every one ends in errors that say where, and in nothing worse.
#include "common/base/error.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class BadInput : public SceneTest {};

/// The shape of the contract's test scene.
constexpr const char* kBox = R"(LookAt 0 1 6.8  0 1 0  0 1 0
Camera "perspective" "float fov" 19.5
Sampler "sobol" "integer pixelsamples" 16
Integrator "bdpt" "integer maxdepth" 6
PixelFilter "box"
Film "rgb" "integer xresolution" 64 "integer yresolution" 64 "string filename" "box.exr"
WorldBegin
AttributeBegin
AreaLightSource "diffuse" "rgb L" [17 12 4]
Shape "trianglemesh" "point3 P" [-0.24 1.98 -0.22 0.23 1.98 -0.22 0.23 1.98 0.16 -0.24 1.98 0.16] "integer indices" [0 1 2 0 2 3]
AttributeEnd
Material "diffuse" "rgb reflectance" [0.7 0.7 0.7]
Shape "trianglemesh" "point3 P" [-1 0 -1 -1 0 1 1 0 1 1 0 -1] "integer indices" [0 1 2 0 2 3]
)";

TEST_F(BadInput, TheBoxItselfIsFine) { EXPECT_TRUE(load(kBox).ok()); }

TEST_F(BadInput, AnyCutInsideOfADirectiveIsAnError) {
  const std::string box = kBox;
  // Up to the end of the light's scope every prefix lacks something that can be noticed.
  const size_t end = box.find("AttributeEnd");
  const size_t world = box.find("WorldBegin\n") + 10;  // an empty world is one
  for (size_t n = 0; n < end; ++n) {
    if (n == world || n == world + 1) continue;
    EXPECT_FALSE(load(box.substr(0, n)).ok()) << box.substr(0, n);
  }
  const size_t list = box.rfind("[0 1 2");
  for (size_t n = list + 1; n < box.size() - 2; ++n)
    EXPECT_FALSE(load(box.substr(0, n)).ok()) << box.substr(0, n);
}

TEST_F(BadInput, ATypoIsReportedAtItsDeclaration) {
  std::string text = kBox;
  text.replace(text.find("reflectance"), 11, "reflectence");
  EXPECT_TRUE(has_error(strictly(text),
                        "scene.pbrt:12:20: unknown parameter \"reflectence\" of material \"diffuse\"; did "
                        "you mean \"reflectance\"?"));
}

TEST_F(BadInput, Structure) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "no WorldBegin"},
      {"Camera \"perspective\"", "no WorldBegin"},
      {"WorldBegin LightSource \"point\" WorldBegin", "WorldBegin is given twice"},
      {"Shape \"sphere\" WorldBegin", "Shape must come after WorldBegin"},
      {"WorldBegin Film \"rgb\"", "Film must come before WorldBegin"},
      {"WorldBegin Shpae \"sphere\"", "unknown directive \"Shpae\"; did you mean \"Shape\"?"},
      {"WorldBegin [ 1 2 3 ]", "a directive is expected, not \"[\""},
      {"WorldBegin \"text\"", "a directive is expected"},
      {"WorldBegin AttributeBegin", "1:12: the scope that begins here is never closed"},
      {"WorldBegin ObjectBegin \"o\"", "never closed"},
      {"WorldBegin AttributeEnd", "AttributeEnd without AttributeBegin"},
      {"WorldBegin AttributeBegin TransformEnd", "TransformEnd without TransformBegin"},
      {"WorldBegin ObjectEnd", "ObjectEnd without ObjectBegin"},
      {"WorldBegin ObjectInstance \"x\"", "no object named \"x\""},
      {"TransformBegin WorldBegin", "not closed before WorldBegin"},
      {"WorldBegin Shape", "Shape needs a type in quotes; the file ends here"},
      {"WorldBegin Shape sphere", "Shape needs a type in quotes"},
      {"WorldBegin Attribute \"shapes\" \"float radius\" 1", "did you mean \"shape\"?"},
      {"WorldBegin CoordSysTransform \"camara\"", "no coordinate system named \"camara\""},
      {"ColorSpace \"sgrb\" WorldBegin", "did you mean \"srgb\"?"},
      {"ActiveTransform Never WorldBegin", "StartTime, EndTime or All"},
      {"Translate 1 2 WorldBegin", "Translate needs 3 finite numbers, not \"WorldBegin\""},
      {"Translate 1 2", "the file ends here"},
      {"Translate 1 2 nan WorldBegin", "finite numbers, not \"nan\""},
      {"Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0] WorldBegin", "needs 16 finite numbers"},
      {"Scale 0 1 1 WorldBegin", "Scale is singular"},
      {"Transform [1 0 0 0 1 0 0 0 0 0 1 0 0 0 0 1] WorldBegin", "Transform is singular"},
      {"Transform [1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1] WorldBegin", "not affine"},
      {"Scale 1e200 1e200 1e200 Scale 1e200 1e200 1e200 WorldBegin", "range of numbers"},
      {"Rotate 30 0 0 0 WorldBegin", "an axis"},
      {"LookAt 0 0 0 0 0 0 0 1 0 WorldBegin", "a target other than the eye"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly(text), message)) << text;
}

TEST_F(BadInput, Options) {
  const std::pair<const char*, const char*> cases[] = {
      {"Film \"rgb\" \"integer xresolution\" 0", "must be at least 1, not 0"},
      {"Film \"rgb\" \"integer xresolution\" -5", "must be at least 1"},
      {"Film \"rgb\" \"integer xresolution\" 100000 \"integer yresolution\" 100000", "must be at most 65536"},
      {"Film \"rgb\" \"integer xresolution\" 65536 \"integer yresolution\" 65536", "pixels; lower it"},
      {"Film \"rgb\" \"float xresolution\" 64", "it must be \"integer\""},
      {"Film \"rgb\" \"float cropwindow\" [0 0 0 1]", "x0 < x1"},
      {"Film \"rgb\" \"integer pixelbounds\" [0 5000 0 10]", "inside the film"},
      {"Film \"rgbx\"", "did you mean \"rgb\"?"},
      {"Sampler \"sobol\" \"integer pixelsamples\" -1", "must be at least 1, not -1"},
      {"Sampler \"sobol\" \"integer pixelsamples\" 0", "must be at least 1"},
      {"Sampler \"sobl\"", "did you mean \"sobol\"?"},
      {"Integrator \"path\" \"integer maxdepth\" -1", "must be at least 0"},
      {"Integrator \"pth\"", "did you mean \"path\"?"},
      {"Camera \"perspective\" \"float fov\" 0", "\"fov\""},
      {"Camera \"perspective\" \"float fov\" 180", "\"fov\""},
      {"Camera \"perspective\" \"float shutterclose\" 0", "the shutter must close"},
      {"Camera \"perspective\" \"float screenwindow\" [1 1 -1 1]", "x0 < x1"},
      {"Camera \"spherical\" \"string mapping\" \"mercator\"",
       "must be \"equalarea\" or \"equirectangular\""},
      {"Camera \"realistic\"", "needs a \"string lensfile\""},
      {"Camera \"realistic\" \"string lensfile\" \"none.dat\"", "there is no file \"none.dat\""},
      {"Film \"rgb\" \"string sensor\" \"canon_eos_5e\"", "did you mean \"canon_eos_5d\""},
      {"Film \"rgb\" \"float whitebalance\" 100", "at least 1900 kelvin"},
      {"PixelFilter \"mitchel\"", "did you mean \"mitchell\""},
      {"Camera \"orthographic\" \"float fov\" 30", "\"fov\""},
      {"Camera \"orthographic\" \"float screenwindow\" [-1 1 1 1]", "y0 < y1"},
      {"Camera \"perspective\" \"float lensradius\" -1", "\"lensradius\""},
      {"Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" 0", "\"focaldistance\""},
      {"Camera \"perspectve\"", "did you mean \"perspective\"?"},
      {"PixelFilter \"triangle\" \"float xradius\" 0", "\"xradius\""},
      {"PixelFilter \"triangel\"", "did you mean \"triangle\"?"},
      {"Accelerator \"bhv\"", "did you mean \"bvh\"?"},
      {"Option \"integer sede\" 1", "did you mean \"seed\"?"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_TRUE(has_error(strictly(std::string(text) + "\nWorldBegin LightSource \"point\""), message))
        << text;
  }
}

TEST_F(BadInput, OneByTwentyThousandWorks) {
  EXPECT_TRUE(load("Film \"rgb\" \"integer xresolution\" 1 \"integer yresolution\" 20000 WorldBegin "
                   "LightSource \"point\"")
                  .ok());
}

TEST_F(BadInput, ReadingGoesOnAfterAnError) {
  const LoadResult r = load_world("Shape \"sphear\"\nMaterial \"difuse\"\nShape \"sphere\"");
  EXPECT_TRUE(mentions(r, "scene.pbrt:2:1"));
  EXPECT_TRUE(mentions(r, "scene.pbrt:3:1"));
  EXPECT_EQ(r.scene.shapes.size(), 1u);
}

TEST_F(BadInput, Files) {
  EXPECT_TRUE(has_error(load_scene("none.pbrt", DirectoryFiles(folder_.path())), "no file \"none.pbrt\""));
  EXPECT_TRUE(
      has_error(load_scene("scene.obj", DirectoryFiles(folder_.path())), "ends in .pbrt, .gltf or .glb"));
  EXPECT_TRUE(has_error(load_scene("scene.gltf", DirectoryFiles(folder_.path())), "no file \"scene.gltf\""));
  EXPECT_TRUE(has_error(strictly_world("Include \"none.pbrt\""), "2:9: there is no file \"none.pbrt\""));
  EXPECT_TRUE(has_error(strictly_world("Include \"\""), "there is no file"));
  std::filesystem::create_directory(folder_.path() + "/dir.ply");
  EXPECT_TRUE(
      has_error(strictly_world("Shape \"plymesh\" \"string filename\" \"dir.ply\""), "not a regular file"));
  EXPECT_TRUE(
      has_error(strictly_world("Shape \"plymesh\" \"string filename\" \"/dev/zero\""), "not a regular file"));
}

TEST_F(BadInput, IncludesEnd) {
  EXPECT_TRUE(has_error(strictly_world("Include \"scene.pbrt\""), "includes itself"));
  folder_.write("a.pbrt", "Include \"b.pbrt\"");
  folder_.write("b.pbrt", "Include \"./a.pbrt\"");
  EXPECT_TRUE(has_error(strictly_world("Include \"a.pbrt\""), "includes itself"));
  for (int i = 0; i < 40; ++i) {
    folder_.write("deep" + std::to_string(i) + ".pbrt", "Include \"deep" + std::to_string(i + 1) + ".pbrt\"");
  }
  EXPECT_TRUE(has_error(strictly_world("Include \"deep0.pbrt\""), "32 deep"));
  // Thirty files, each of which includes the next twice: 2^30 without a bound.
  for (int i = 0; i < 30; ++i) {
    const std::string next = "Include \"twice" + std::to_string(i + 1) + ".pbrt\"\n";
    folder_.write("twice" + std::to_string(i) + ".pbrt", next + next);
  }
  folder_.write("twice30.pbrt", "");
  EXPECT_TRUE(has_error(strictly_world("Include \"twice0.pbrt\""), "more than 200000 files"));
}

TEST_F(BadInput, ManyErrorsStayBounded) {
  std::string text = "WorldBegin\n";
  for (int i = 0; i < 5000; ++i) text += "Shape 7\n";
  const LoadResult r = load(text);
  EXPECT_FALSE(r.ok());
  EXPECT_LE(r.problems.size(), 300u);
}

TEST_F(BadInput, DeepNestingIsRefused) {
  std::string text = "WorldBegin\n";
  for (int i = 0; i < 300000; ++i) text += "AttributeBegin\n";
  EXPECT_TRUE(has_error(strictly(text), "nested more than 200000"));
}

TEST_F(BadInput, TheCommandLineGetsOneLine) {
  folder_.write("bad.pbrt", "WorldBegin Shape 7 Material 8");
  try {
    load_scene_file(folder_.path() + "/bad.pbrt", {}, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 2);
    const std::string what = e.what();
    EXPECT_EQ(what.find('\n'), std::string::npos);
    EXPECT_NE(what.find("bad.pbrt:1:18: Shape needs a type in quotes"), std::string::npos) << what;
    EXPECT_NE(what.find("(and 1 more)"), std::string::npos) << what;
  }
  int warnings = 0;
  folder_.write("warn.pbrt",
                "WorldBegin LightSource \"point\" Material \"dielectric\" "
                "\"spectrum eta\" \"glass-BK7\"");
  load_scene_file(folder_.path() + "/warn.pbrt", {}, [&](const Problem&) { ++warnings; });
  EXPECT_EQ(warnings, 1);
}

}  // namespace
}  // namespace lightmill
