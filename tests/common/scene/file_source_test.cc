// Names of files as other programs and other machines write them.
#include "common/scene/file_source.h"

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class FileNames : public ::testing::Test {
 protected:
  FileNames() {
    folder.write("textures/Wood.png", "w");
    folder.write("textures/two.png", "");
    folder.write("textures/TWO.png", "");
    folder.write("textures/with space.png", "");
    folder.write("sky.exr", "");
  }
  std::string found(const std::string& name, const PathMap& map = {}) {
    how.clear();
    const std::string path = DirectoryFiles(folder.path(), map).resolve(name, &how);
    return path.empty() ? "" : std::filesystem::path(path).lexically_relative(folder.path()).string();
  }
  TempFolder folder;
  std::string how;
};

TEST_F(FileNames, TheRightOneIsTakenInSilence) {
  EXPECT_EQ(found("textures/Wood.png"), "textures/Wood.png");
  EXPECT_EQ(found("./textures/../sky.exr"), "sky.exr");
  EXPECT_EQ(how, "");
  EXPECT_EQ(found("none.png"), "");
  EXPECT_EQ(how, "");
}

TEST_F(FileNames, OfOtherSystems) {
  for (const char* name : {"textures\\Wood.png", "TEXTURES/wood.PNG", "textures%2FWood.png",
                           "/home/ann/job/textures/Wood.png", "C:\\job\\textures\\wood.png",
                           "../shared/textures/Wood.png", "\\\\server\\share\\textures\\Wood.png"}) {
    EXPECT_EQ(found(name), "textures/Wood.png") << name;
    EXPECT_EQ(how, "the file \"textures/Wood.png\" is taken") << name;
  }
  EXPECT_EQ(found("textures/with%20space.png"), "textures/with space.png");
  EXPECT_EQ(found("textures/Two.png"), "") << "either of two";
  EXPECT_EQ(found("C:\\elsewhere\\sky.exr"), "sky.exr");
}

TEST_F(FileNames, AccentsAreSpelledInTwoWays) {
  const std::string one = "caf\xc3\xa9.png",
                    two = "cafe\xcc\x81.png";  // U+00E9; e and U+0301, as macOS has it
  folder.write("a/" + one, "");
  folder.write("b/" + two, "");
  folder.write("c/" + one, "");
  folder.write("c/" + two, "");
  EXPECT_EQ(found("a/" + two), "a/" + one);
  EXPECT_EQ(how, "the file \"a/" + one + "\" is taken");
  EXPECT_EQ(found("b/" + one), "b/" + two);
  EXPECT_EQ(found("B/CAF\xc3\x89.png"), "b/" + two) << "capitals, too";
  EXPECT_EQ(found("c/" + one), "c/" + one);
  EXPECT_EQ(how, "") << "the very name goes first";
}

TEST_F(FileNames, MapsComeFirst) {
  const PathMap map = {{"P:/show", folder.path() + "/textures"}};
  EXPECT_EQ(found("P:\\show\\Wood.png", map), "textures/Wood.png");
  EXPECT_EQ(how, "") << "as it was asked for";
}

TEST_F(FileNames, AMissingOneHasAHint) {
  EXPECT_EQ(DirectoryFiles(folder.path()).hint("textures/Woods.png"), "; did you mean \"Wood.png\"?");
  EXPECT_EQ(DirectoryFiles(folder.path()).hint("nothing-like-it"), "");
}

using SceneFileNames = SceneTest;

TEST_F(SceneFileNames, WarnAndEndInTheBundleUnderTheNameThatTheSceneHas) {
  folder_.write("Wood.png", "");
  const LoadResult r = load_world(
      "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"maps\\\\wood.png\"\n"
      "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"");
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_TRUE(mentions(r, "there is no file \"maps\\wood.png\"; the file \"Wood.png\" is taken"))
      << listed(r);
  EXPECT_EQ(r.scene.files.size(), 2u);
}

TEST_F(SceneFileNames, AllMissingFilesAreListedAtOnce) {
  folder_.write("wood.png", "");
  const LoadResult r = load_world(
      "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"woods.png\"\n"
      "Texture \"b\" \"spectrum\" \"imagemap\" \"string filename\" \"other.png\"");
  EXPECT_FALSE(r.ok());
  EXPECT_TRUE(
      mentions(r, "\"woods.png\"; names are relative to the main scene file; did you mean \"wood.png\"?"));
  EXPECT_TRUE(mentions(r, "\"other.png\""));
}

TEST_F(SceneFileNames, MissingImagesAreGreyIfAskedFor) {
  LoadOptions options;
  options.missing_textures = true;
  const LoadResult r = load_world(
      "Texture \"a\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\"\n"
      "Material \"diffuse\" \"texture reflectance\" \"a\" Shape \"sphere\"",
      options);
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_TRUE(mentions(r, "\"none.png\"; one grey is taken")) << listed(r);
  EXPECT_TRUE(r.scene.missing_textures);
}

TEST_F(SceneFileNames, ASceneWithoutLightsGetsASky) {
  const LoadResult r = load("WorldBegin Shape \"sphere\"");
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_TRUE(mentions(r, "white sky of radiance 1"));
  EXPECT_EQ(r.scene.lights.size(), 1u);
  LoadOptions options;
  options.strict_lights = true;
  EXPECT_TRUE(load("WorldBegin Shape \"sphere\"", options).scene.lights.empty());
}

TEST_F(SceneFileNames, PackedScenes) {
  // printf 'WorldBegin LightSource "point"' | gzip -n
  const unsigned char packed[] = {
      0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03, 0x0b, 0xcf, 0x2f, 0xca, 0x49, 0x71, 0x4a,
      0x4d, 0xcf, 0xcc, 0x53, 0xf0, 0xc9, 0x4c, 0xcf, 0x28, 0x09, 0xce, 0x2f, 0x2d, 0x4a, 0x4e, 0x55, 0x50,
      0x2a, 0xc8, 0xcf, 0xcc, 0x2b, 0x51, 0x02, 0x00, 0xe8, 0x5c, 0x74, 0xda, 0x1e, 0x00, 0x00, 0x00};
  folder_.write("scene.pbrt.gz", std::string(reinterpret_cast<const char*>(packed), sizeof packed));
  const LoadResult r = load_scene("scene.pbrt.gz", DirectoryFiles(folder_.path()));
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.scene.lights.size(), 1u);
}

}  // namespace
}  // namespace lightmill
