// How pbrt-v3's scenes are put together: what pbrt-v3 passes over is no error.
#include <cmath>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class PbrtV3Structure : public SceneTest {
 protected:
  /// A complete v3 file around `body`, which must load; what it warns of goes to `messages`.
  SceneDescription v3(const std::string& body) {
    LoadResult r = load("Film \"image\"\nWorldBegin LightSource \"point\"\n" + body + "\nWorldEnd");
    EXPECT_TRUE(r.ok()) << listed(r);
    messages = listed(r);
    return std::move(r.scene);
  }
  bool says(const std::string& text) const { return messages.find(text) != std::string::npos; }
  std::string messages;
};

TEST_F(PbrtV3Structure, ParametersFollowAnInclude) {
  folder_.write("ball.pbrt", "Material \"matte\" \"rgb Kd\" [1 0 0]\nShape \"sphere\" \"float radius\" 2");
  const SceneDescription scene =
      v3("Include \"ball.pbrt\" \"float zmin\" [-1]\n \"float zmax\" 1\n"
         "Include \"ball.pbrt\" \"float radius\" 3 Shape \"sphere\" \"float radius\" 5");
  ASSERT_EQ(scene.shapes.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<MeshShape>(scene.shapes[0].kind)) << "a part of the sphere";
  ASSERT_TRUE(std::holds_alternative<SphereShape>(scene.shapes[1].kind));
  EXPECT_FLOAT_EQ(std::get<SphereShape>(scene.shapes[1].kind).radius, 3);
  EXPECT_FLOAT_EQ(std::get<SphereShape>(scene.shapes[2].kind).radius, 5);
  EXPECT_TRUE(has_error(strictly("WorldBegin Include \"none.pbrt\" \"float a\" 1"), "there is no file"));
  folder_.write("empty.pbrt", "# nothing");
  EXPECT_TRUE(
      has_error(strictly("WorldBegin Include \"empty.pbrt\" \"float a\" 1"), "a directive is expected"));
}

TEST_F(PbrtV3Structure, AFileMayHoldFurtherPictures) {
  const SceneDescription scene = v3("Shape \"sphere\" WorldEnd\nFilm \"image\" WorldBegin Shape \"disk\"");
  EXPECT_EQ(scene.shapes.size(), 1U);
  EXPECT_TRUE(says("scene.pbrt:4:1: warning: a further picture begins here, after WorldEnd")) << messages;
}

TEST_F(PbrtV3Structure, DirectivesOutOfPlaceArePassedOver) {
  const SceneDescription scene = v3("Film \"image\" \"integer xresolution\" 7\nShape \"sphere\"");
  EXPECT_EQ(scene.film.width, 640);
  EXPECT_TRUE(says("scene.pbrt:3:1: warning: Film must come before WorldBegin")) << messages;
  LoadResult early = load("Film \"image\" Shape \"sphere\" \"float radius\" 2\nWorldBegin Shape \"sphere\"");
  EXPECT_TRUE(early.ok()) << listed(early);
  EXPECT_TRUE(mentions(early, "1:14: warning: Shape must come after WorldBegin"));
  EXPECT_FALSE(load("Film \"rgb\" Shape \"sphere\" WorldBegin").ok()) << "nor does pbrt-v4";
}

TEST_F(PbrtV3Structure, ScopesMayCross) {
  // As in pbrt-v3's San Miguel.
  const SceneDescription scene =
      v3("AttributeBegin\nTranslate 1 0 0\nObjectBegin \"o\"\nAttributeBegin Shape \"sphere\" AttributeEnd\n"
         "AttributeEnd ObjectEnd\nObjectInstance \"o\" Shape \"disk\"");
  EXPECT_TRUE(says("scene.pbrt:7:1: warning: AttributeEnd closes the scope that began at line 5"))
      << messages;
  ASSERT_EQ(scene.objects.size(), 1U);
  EXPECT_EQ(scene.objects[0].shapes.size(), 1U);
  ASSERT_EQ(scene.instances.size(), 1U);
  EXPECT_EQ(scene.instances[0].object_to_world.m[0][3], 0) << "all scopes are closed";
}

TEST_F(PbrtV3Structure, TransformsHaveAStackOfTheirOwn) {
  const SceneDescription scene =
      v3("AttributeBegin Material \"mirror\" Translate 1 0 0 TransformBegin Translate 2 0 0\n"
         "AttributeEnd Shape \"sphere\" TransformEnd Shape \"sphere\"");
  ASSERT_EQ(scene.shapes.size(), 2U);
  EXPECT_EQ(scene.shapes[0].object_to_world.m[0][3], 1) << "that of TransformBegin";
  EXPECT_EQ(scene.shapes[1].object_to_world.m[0][3], 0);
}

TEST_F(PbrtV3Structure, UnmatchedEndsAndOpenScopes) {
  v3("AttributeEnd Shape \"sphere\"");
  EXPECT_TRUE(says("AttributeEnd without AttributeBegin")) << messages;
  v3("TransformEnd Shape \"sphere\"");
  EXPECT_TRUE(says("TransformEnd without TransformBegin")) << messages;
  v3("ObjectEnd AttributeBegin Shape \"sphere\"");
  EXPECT_TRUE(says("ObjectEnd without ObjectBegin")) << messages;
  EXPECT_TRUE(says("scene.pbrt:3:11: warning: the scope that begins here is never closed")) << messages;
  EXPECT_FALSE(load("Film \"image\" WorldBegin AttributeBegin Shape \"sphere\"").ok())
      << "no WorldEnd: cut off";
  EXPECT_FALSE(load("Film \"image\" WorldBegin ObjectBegin \"o\" Shape \"sphere\" WorldEnd").ok());
}

TEST_F(PbrtV3Structure, Objects) {
  const SceneDescription scene =
      v3("ObjectBegin \"o\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\"\n"
         "ObjectBegin \"o\" Shape \"disk\" ObjectEnd ObjectInstance \"o\"\nObjectInstance \"p\"");
  EXPECT_TRUE(
      says("scene.pbrt:4:1: warning: the object \"o\" is defined twice; this one holds from here on"));
  EXPECT_TRUE(says("scene.pbrt:5:1: warning: there is no object named \"p\"")) << messages;
  ASSERT_EQ(scene.instances.size(), 2U);
  EXPECT_NE(scene.instances[0].object, scene.instances[1].object);
}

TEST_F(PbrtV3Structure, MatricesOfAnyScale) {
  const SceneDescription scene = v3("Transform [2 0 0 0  0 2 0 0  0 0 2 0  6 0 0 2] Shape \"sphere\"");
  EXPECT_EQ(scene.shapes[0].object_to_world.m[0][3], 3);
  EXPECT_EQ(scene.shapes[0].object_to_world.m[1][1], 1);
  EXPECT_TRUE(says("Transform has 2 as its last number")) << messages;
  const SceneDescription other = v3("Transform [1 0 0 0  0 1 0 0  0 0 1 8  0 0 0 1] Shape \"sphere\"");
  EXPECT_EQ(other.shapes[0].object_to_world.m[3][2], 0);
  EXPECT_TRUE(says("is not affine: the last row must be 0 0 0 1, which is taken")) << messages;
  v3("Rotate 0 0 0 0 Shape \"sphere\"");
  EXPECT_TRUE(says("Rotate needs an axis that is not 0 0 0; it is left out")) << messages;
}

TEST_F(PbrtV3Structure, CommasAndEmptyLists) {
  const SceneDescription scene =
      v3("Translate 1, 2,3 Shape \"disk\" \"float radius\" [2,] Shape \"trianglemesh\" \"point P\" []");
  ASSERT_EQ(scene.shapes.size(), 1U);
  EXPECT_EQ(scene.shapes[0].object_to_world.m[2][3], 3);
  EXPECT_TRUE(says("3:12: warning: commas stand between values; they are passed over\n")) << messages;
  EXPECT_TRUE(says("parameter \"P\" has no value; it is left out")) << messages;
}

TEST_F(PbrtV3Structure, OtherNamesNeverStandForAFileThatIsOpen) {
  const LoadResult r =
      load("Film \"image\" WorldBegin LightSource \"point\"\nInclude \"geometry/scene.pbrt\"");
  EXPECT_TRUE(mentions(r, "2:9: there is no file \"geometry/scene.pbrt\"")) << listed(r);
}

TEST_F(PbrtV3Structure, PointersOfGitLfs) {
  folder_.write("a.ply", "version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 1432\n");
  const LoadResult r = load_world("Shape \"plymesh\" \"string filename\" \"a.ply\"");
  EXPECT_TRUE(mentions(r, "it is a pointer of Git LFS; `git lfs pull` fetches the file itself")) << listed(r);
}

TEST_F(PbrtV3Structure, NamesThatAreNotThere) {
  const SceneDescription scene =
      v3("Material \"matte\" \"rgb Kd\" [1 0 0]\nNamedMaterial \"none such\" Shape \"sphere\"\n"
         "Material \"matte\" \"texture Kd\" \"no such\" Shape \"sphere\"");
  EXPECT_TRUE(
      says("scene.pbrt:4:15: warning: there is no material named \"none such\"; the one before it is kept"))
      << messages;
  EXPECT_TRUE(says("names the spectrum texture \"no such\", which is not defined above; it is left out"));
  const auto red = [&](size_t shape) {
    const auto material = static_cast<size_t>(scene.shapes.at(shape).material);
    return std::get<DiffuseMaterial>(scene.materials.at(material).kind).reflectance.value;
  };
  EXPECT_EQ(red(0), (Rgb{1, 0, 0}));
  EXPECT_EQ(red(1), (Rgb{.5f, .5f, .5f})) << "the default";
}

TEST_F(PbrtV3Structure, SpectrumTexturesStandForNumbers) {
  const SceneDescription scene = v3(
      "Texture \"a\" \"color\" \"constant\" \"rgb value\" [.3 .6 .9]\n"
      "Texture \"b\" \"color\" \"checkerboard\" \"texture tex1\" \"a\" \"rgb tex2\" [0 .3 0]\n"
      "MakeNamedMaterial \"m\" \"string type\" \"matte\" MakeNamedMaterial \"n\" \"string type\" \"mirror\"\n"
      "Material \"mix\" \"string namedmaterial1\" \"m\" \"string namedmaterial2\" \"n\" \"texture amount\" "
      "\"b\"\n"
      "Shape \"sphere\"");
  EXPECT_TRUE(says("names a spectrum texture where a float one belongs; its mean is taken")) << messages;
  const auto& mix =
      std::get<MixMaterial>(scene.materials.at(static_cast<size_t>(scene.shapes[0].material)).kind);
  ASSERT_GE(mix.amount.texture, 0);
  const TextureDescription& amount = scene.textures.at(static_cast<size_t>(mix.amount.texture));
  EXPECT_FALSE(amount.is_spectrum);
  const auto& board = std::get<CheckerboardTexture>(amount.kind);
  EXPECT_FLOAT_EQ(board.tex2.value.r, .1f);
  const TextureDescription& first = scene.textures.at(static_cast<size_t>(board.tex1.texture));
  EXPECT_FLOAT_EQ(std::get<ConstantTexture>(first.kind).value.g, .6f);
}

TEST_F(PbrtV3Structure, ShapesMayChangeTheirMaterial) {
  const SceneDescription scene =
      v3("MakeNamedMaterial \"m\" \"string type\" \"plastic\" \"rgb Kd\" [1 0 0] \"float roughness\" .5\n"
         "NamedMaterial \"m\" Shape \"sphere\" \"rgb Kd\" [0 1 0] Shape \"sphere\"\n"
         "Texture \"t\" \"color\" \"scale\" Shape \"sphere\" \"texture Kd\" \"t\"");
  EXPECT_EQ(messages, "");
  const auto coat = [&](size_t shape) {
    const auto material = static_cast<size_t>(scene.shapes.at(shape).material);
    return std::get<CoatedDiffuseMaterial>(scene.materials.at(material).kind);
  };
  EXPECT_EQ(coat(0).reflectance.value, (Rgb{0, 1, 0}));
  EXPECT_FLOAT_EQ(coat(0).roughness.u.value, .5f);
  EXPECT_EQ(coat(1).reflectance.value, (Rgb{1, 0, 0}));
  EXPECT_EQ(coat(2).reflectance.value, (Rgb{1, 1, 1})) << "the texture, folded";
}

TEST_F(PbrtV3Structure, DirectLightingGoesThroughGlass) {
  const auto depth = [&](const std::string& materials) {
    const LoadResult r = load(
        "Integrator \"whitted\" \"integer maxdepth\" 7 Film \"image\"\nWorldBegin LightSource "
        "\"point\" " +
        materials + " Shape \"sphere\" WorldEnd");
    EXPECT_TRUE(r.ok()) << listed(r);
    EXPECT_TRUE(mentions(r, "1:1: warning: an integrator of direct light is read as \"path\"")) << listed(r);
    return r.scene.sampling.max_depth;
  };
  EXPECT_EQ(depth("Material \"glass\" Material \"matte\""), 1) << "no glass in use";
  EXPECT_EQ(depth("Material \"metal\""), 1);
  EXPECT_EQ(depth("Material \"glass\""), 7);
  EXPECT_EQ(depth("Material \"mirror\""), 7);
  EXPECT_EQ(depth("MakeNamedMaterial \"g\" \"string type\" \"glass\" MakeNamedMaterial \"m\" \"string type\" "
                  "\"matte\" "
                  "Material \"mix\" \"string namedmaterial1\" \"m\" \"string namedmaterial2\" \"g\""),
            7);
}

TEST_F(PbrtV3Structure, RealisticCameraOfExercises) {
  folder_.write("lens.dat", "# radius sep n aperture\n35 1 1.5 20\n0 2 0 8\n-30 1 1 20\n");
  const LoadResult r = load(
      "Camera \"realistic\" \"string specfile\" \"lens.dat\" \"float aperture_diameter\" 6\n"
      "\"float filmdiag\" 70 Film \"image\" WorldBegin LightSource \"point\" Shape \"sphere\"");
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.scene.camera.lens.elements.size(), 3U);
  EXPECT_EQ(r.scene.camera.lens.aperture_diameter, 6);
  EXPECT_EQ(r.scene.camera.lens.film_diagonal, 70);
}

}  // namespace
}  // namespace lightmill
