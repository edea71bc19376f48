// MakeNamedMedium, MediumInterface and what takes them over.
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class PbrtMedia : public SceneTest {};

TEST_F(PbrtMedia, HomogeneousOnesAreReadWithTheirScale) {
  const SceneDescription s = clean_world(
      "MakeNamedMedium \"a\" \"string type\" \"homogeneous\"\n"
      "MakeNamedMedium \"b\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [4 5 "
      "6]\n"
      "  \"float scale\" 0.5 \"float g\" -0.25 \"rgb Le\" [1 0.5 0] \"float Lescale\" 4\n"
      "MakeNamedMedium \"c\" \"string type\" \"homogeneous\" \"string preset\" \"Skin1\" \"float scale\" "
      "2\n");
  ASSERT_EQ(s.media.size(), 3u);
  EXPECT_EQ(s.media[0].sigma_a, (Rgb{1, 1, 1}));  // pbrt-v4's defaults
  EXPECT_EQ(s.media[0].sigma_s, (Rgb{1, 1, 1}));
  EXPECT_EQ(s.media[0].g, 0);
  EXPECT_EQ(s.media[1].sigma_a, (Rgb{0.5f, 1, 1.5f}));
  EXPECT_EQ(s.media[1].sigma_s, (Rgb{2, 2.5f, 3}));
  EXPECT_EQ(s.media[1].g, -0.25f);
  EXPECT_EQ(s.media[1].emission, (Rgb{4, 2, 0}));
  EXPECT_EQ(s.media[2].sigma_s, (Rgb{1.48f, 1.76f, 2.02f}));
  EXPECT_EQ(s.media[2].sigma_a, (Rgb{0.064f, 0.34f, 0.96f}));
}

TEST_F(PbrtMedia, TheirLightMayBelongToAGroup) {
  const SceneDescription s = clean_world(
      "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"rgb Le\" [1 1 1] \"string lightgroup\" "
      "\"fire\"\n"
      "MakeNamedMedium \"b\" \"string type\" \"uniformgrid\" \"float density\" 1 \"string lightgroup\" "
      "\"fire\"\n"
      "MakeNamedMedium \"c\" \"string type\" \"homogeneous\"\n");
  EXPECT_EQ(s.media.at(0).light_group, "fire");
  EXPECT_EQ(s.media.at(1).light_group, "fire");
  EXPECT_EQ(s.media.at(2).light_group, "");
}

TEST_F(PbrtMedia, InterfacesAreInForceAsOtherAttributes) {
  const SceneDescription s =
      clean(load("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\n"
                 "MediumInterface \"\" \"fog\" Camera \"perspective\" WorldBegin LightSource \"point\"\n"
                 "AttributeBegin MediumInterface \"milk\" \"fog\" Shape \"sphere\" AttributeEnd\n"
                 "AttributeBegin MediumInterface \"\" LightSource \"point\" Shape \"sphere\" AttributeEnd\n"
                 "Shape \"sphere\" MakeNamedMedium \"milk\" \"string type\" \"homogeneous\"\n"));
  EXPECT_EQ(s.camera.medium, 0);
  EXPECT_EQ(s.lights[0].medium, 0);
  EXPECT_EQ(s.lights[1].medium, -1);
  ASSERT_EQ(s.shapes.size(), 3u);
  EXPECT_EQ(s.shapes[0].media, (MediumInterface{1, 0}));
  EXPECT_EQ(s.shapes[1].media, (MediumInterface{-1, -1}));
  EXPECT_EQ(s.shapes[2].media, (MediumInterface{-1, 0}));
  EXPECT_EQ(s.media[1].name, "milk");
}

TEST_F(PbrtMedia, ShapesWithoutASurfaceAreBoundariesOrNothing) {
  const SceneDescription s = clean_world(
      "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" Material \"interface\" Shape \"sphere\"\n"
      "MediumInterface \"fog\" Shape \"sphere\" MediumInterface \"fog\" \"\" Shape \"sphere\"\n"
      "Material \"diffuse\" Shape \"sphere\"");
  ASSERT_EQ(s.shapes.size(), 2u);
  EXPECT_TRUE(s.shapes[0].boundary);
  EXPECT_FALSE(s.shapes[1].boundary);
}

TEST_F(PbrtMedia, ThatPbrtsIntegratorLeavesOutAreWarnedOf) {
  const std::string fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\n",
                    world =
                        "WorldBegin LightSource \"point\" MediumInterface \"fog\" \"\" Shape \"sphere\"\n";
  const std::string path = "Integrator \"path\"\n";
  const LoadResult warned = load(path + fog + world);
  ASSERT_EQ(warned.problems.size(), 1u);
  EXPECT_NE(warned.problems[0].message.find("\"path\" leaves the scene's media out"), std::string::npos);
  EXPECT_EQ(warned.problems[0].where.line, 1);
  clean(load("Integrator \"volpath\"\n" + fog + world));
  clean(load(path + fog + "WorldBegin LightSource \"point\" Shape \"sphere\"\n"));
}

TEST_F(PbrtMedia, GridsAreReadWithTheirBoxAndTransform) {
  const SceneDescription s = clean_world(
      "Translate 1 2 3 MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer "
      "nz\" 2\n"
      "  \"float density\" [0 1 2 3] \"point3 p0\" [1 0 -1] \"point3 p1\" [-1 2 1] \"rgb sigma_s\" [4 5 6]\n"
      "  \"float scale\" 0.5 \"float g\" 0.25 \"rgb Le\" [1 0.5 0] \"float Lescale\" [1 2 3 4]\n");
  ASSERT_EQ(s.media.size(), 1u);
  const MediumDescription& m = s.media[0];
  EXPECT_EQ(m.sigma_s, (Rgb{2, 2.5f, 3}));
  EXPECT_EQ(m.sigma_a, (Rgb{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(m.g, 0.25f);
  EXPECT_EQ(m.emission, (Rgb{1, 0.5f, 0}));
  ASSERT_NE(m.grid, nullptr);
  EXPECT_EQ(m.grid->medium_to_world.m[1][3], 2);
  EXPECT_EQ(m.grid->lo.x, -1);
  EXPECT_EQ(m.grid->hi.y, 2);
  EXPECT_EQ(m.grid->density->nx, 2);
  EXPECT_EQ(m.grid->density->ny, 1);
  EXPECT_EQ(m.grid->density->values, (std::vector<float>{0, 1, 2, 3}));
  EXPECT_EQ(m.grid->emission->values, (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(brightest(m), (Rgb{4, 2, 0}));
}

TEST_F(PbrtMedia, FireHasATemperature) {
  const SceneDescription s = clean_world(
      "MakeNamedMedium \"fire\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [1 2]\n"
      "  \"float temperature\" [1300 800] \"float temperatureoffset\" 300 \"float temperaturescale\" 2\n");
  const MediumGrid& grid = *s.media[0].grid;
  EXPECT_EQ(grid.temperature->values, (std::vector<float>{2000, 1000}));
  EXPECT_EQ(grid.emission->nx, 1);  // one factor, which falls off from the middle, as pbrt has it
  EXPECT_EQ(s.media[0].emission, (Rgb{1, 1, 1}));
}

TEST_F(PbrtMedia, RgbGridsHaveCoefficientsOfTheirOwn) {
  const SceneDescription s = clean_world(
      "MakeNamedMedium \"dye\" \"string type\" \"rgbgrid\" \"integer ny\" 2 \"rgb sigma_a\" [1 2 3 4 5 6]\n"
      "  \"float scale\" 2 \"rgb Le\" [0 0 0 1 1 1] \"float Lescale\" 3\n");
  const MediumDescription& m = s.media[0];
  EXPECT_EQ(m.grid->density, nullptr);
  EXPECT_EQ(m.grid->sigma_a->values, (std::vector<float>{2, 4, 6, 8, 10, 12}));
  EXPECT_EQ(m.grid->sigma_s, nullptr);
  EXPECT_EQ(m.sigma_s, (Rgb{2, 2, 2}));  // pbrt's 1, scaled
  EXPECT_EQ(m.emission, (Rgb{3, 3, 3}));
  EXPECT_FLOAT_EQ(m.grid->emission->values[3], 106.856895f);  // pbrt does not scale this light
}

TEST_F(PbrtMedia, VolumeFilesAreReferredTo) {
  // The header of a NanoVDB file without grids.
  std::string none = "NanoVDB0";
  none += std::string("\x02\x10\x00\x04\x00\x00\x00\x00", 8);
  folder_.write("none.nvdb", none);
  folder_.write("text.nvdb", "hello, hello, hello");
  const std::string medium = "MakeNamedMedium \"m\" \"string type\" \"nanovdb\" ";
  const std::pair<std::string, const char*> cases[] = {
      {medium, "needs a \"string filename\"; it is empty space"},
      {medium + "\"string filename\" \"some.nvdb\"", "there is no file \"some.nvdb\""},
      {medium + "\"string filename\" \"text.nvdb\"", "has a file, \"text.nvdb\", that is not a NanoVDB file"},
      {medium + "\"string filename\" \"none.nvdb\"",
       "names the grid \"density\", which is not in \"none.nvdb\""},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = strictly_world(text);
    EXPECT_TRUE(has_error(r, message)) << text << "\n" << listed(r);
    EXPECT_TRUE(mentions(r, "scene.pbrt:2:")) << text << "\n" << listed(r);
  }
}

// Whichever type a file has, its first bytes say how it is read.
TEST_F(PbrtMedia, OpenVdbFilesAreReferredTo) {
  const std::filesystem::path files =
      std::filesystem::path(LIGHTMILL_SOURCE_DIR) / "tests/common/scene/volume/openvdb/files";
  std::filesystem::copy_file(files / "several.vdb", std::filesystem::path(folder_.path()) / "several.vdb");
  for (const char* type : {"vdb", "nanovdb"}) {
    const std::string medium = std::string("MakeNamedMedium \"m\" \"string type\" \"") + type +
                               "\" \"string filename\" \"several.vdb\" ";
    const LoadResult good = strictly_world(medium);
    ASSERT_TRUE(good.ok()) << listed(good);
    const MediumDescription& m = good.scene.media[0];
    ASSERT_TRUE(m.grid && m.grid->file) << type;
    EXPECT_EQ(m.grid->file->density, "density");
    EXPECT_EQ(m.grid->file->temperature, "");
    EXPECT_TRUE(has_error(strictly_world(medium + "\"string gridname\" \"surface\""), "is a level set"));
    EXPECT_TRUE(
        has_error(strictly_world(medium + "\"string gridname\" \"color\""), "has values that are no floats"));
    EXPECT_TRUE(has_error(strictly_world(medium + "\"string gridname\" \"heat\""),
                          "which is not in \"several.vdb\"; there are: \"color\", \"density\""));
  }
}

TEST_F(PbrtMedia, BadGridsAreEmptySpaceAndSaySo) {
  const std::string grid = "MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" ";
  const std::pair<std::string, const char*> cases[] = {
      {grid, "needs a \"float density\" with a value for each voxel; it is empty space"},
      {grid + "\"integer nx\" 2 \"float density\" [1 2 3]", "has 3 values, where nx, ny and nz ask for 2"},
      {grid + "\"integer nx\" 0 \"float density\" 1", "nx"},
      {grid + "\"integer nx\" 100000 \"integer ny\" 100000 \"float density\" 1", "more than 2^31 voxels"},
      {grid + "\"float density\" -1", "must be within 0 and 1e30"},
      {grid + "\"float density\" 1 \"point3 p1\" [1 0 1]", "without a volume"},
      {"Scale 1 1 0 " + grid + "\"float density\" 1", "the transform is singular"},
      {"MakeNamedMedium \"m\" \"string type\" \"rgbgrid\" \"rgb Le\" [1 1 1]", "needs \"rgb sigma_a\" or"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = strictly_world(text);
    EXPECT_TRUE(has_error(r, message)) << text << "\n" << listed(r);
    EXPECT_TRUE(mentions(r, "scene.pbrt:2:")) << text << "\n" << listed(r);
  }
}

TEST_F(PbrtMedia, BadOnesAreRefusedWithTheirLine) {
  const std::string fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" ";
  const std::pair<std::string, const char*> cases[] = {
      {"MediumInterface \"fob\" \"\"\n" + fog, "there is no medium named \"fob\"; did you mean \"fog\"?"},
      {fog + fog, "is defined twice"},
      {fog + "\"float g\" 1", "g"},
      {fog + "\"rgb sigma_a\" [-1 0 0]", "must not be negative"},
      {fog + "\"float scale\" -1", "scale"},
      {fog + "\"rgb sigma_s\" [1e20 0 0] \"float scale\" 1e20", "beyond 1e30"},
      {fog + "\"string preset\" \"Skin3\"", "did you mean \"Skin1\"?"},
      {fog + "\"float sigma\" 1", "sigma"},
      {"MakeNamedMedium \"fog\" \"string type\" \"homogenous\"", "did you mean \"homogeneous\"?"},
      {"MakeNamedMedium \"fog\"", "needs a \"string type\""},
      {"MakeNamedMedium \"\" \"string type\" \"homogeneous\"", "needs a name"},
  };
  for (const auto& [text, message] : cases) {
    const LoadResult r = strictly_world(text);
    EXPECT_TRUE(has_error(r, message)) << text << "\n" << listed(r);
    EXPECT_TRUE(mentions(r, "scene.pbrt:2:")) << text << "\n" << listed(r);
  }
}

}  // namespace
}  // namespace lightmill
