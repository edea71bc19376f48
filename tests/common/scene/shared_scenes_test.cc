// The project's own scenes, and the shared ones beside the checkout where they exist.
#include <algorithm>

#include "common/scene/bundle.h"
#include "common/scene/resolve_settings.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

LoadResult load_path(const fs::path& path) {
  return load_scene(path.filename().string(), DirectoryFiles(path.parent_path().string()));
}

size_t triangles(const SceneDescription& scene) {
  size_t sum = 0;
  for (const ShapeDescription& s : scene.shapes) {
    if (const auto* mesh = std::get_if<MeshShape>(&s.kind)) sum += mesh->mesh->triangles.size();
  }
  return sum;
}

TEST(OwnScenes, LoadWithoutAWord) {
  for (const auto& [name, width] : {std::pair{"cornell-spheres.pbrt", 300},
                                    {"ring-caustic.pbrt", 300},
                                    {"motion-blur.pbrt", 400},
                                    {"pool.pbrt", 400},
                                    {"three-lamps.pbrt", 400}}) {
    const LoadResult r = load_path(fs::path(LIGHTMILL_SOURCE_DIR) / "scenes" / name);
    EXPECT_EQ(listed(r), "") << name;
    const RenderSettings s = resolve_settings(r.scene, {});
    EXPECT_EQ(s.grid.width, width);
    EXPECT_EQ(s.grid.height, 300);
    EXPECT_FALSE(make_bundle(r.scene, nullptr).digest().empty());
  }
}

TEST(OwnScenes, MaterialsAsGltf) {
  const LoadResult r = load_path(fs::path(LIGHTMILL_SOURCE_DIR) / "scenes/materials.gltf");
  EXPECT_EQ(listed(r), "");
  EXPECT_EQ(r.scene.shapes.size(), 7u);
  EXPECT_EQ(r.scene.lights.size(), 1u);
  EXPECT_EQ(r.scene.area_lights.size(), 1u);
  EXPECT_EQ(resolve_settings(r.scene, {}).grid.height, 720);
}

TEST(OwnScenes, TheWindmillTurns) {
  const auto load = [](double time, double closes) {
    LoadOptions options;
    options.pose.animation = "Storm";
    options.pose.time = time;
    options.pose.closes = closes;
    const fs::path folder = fs::path(LIGHTMILL_SOURCE_DIR) / "scenes";
    LoadResult r = load_scene("windmill.gltf", DirectoryFiles(folder.string()), options);
    EXPECT_EQ(listed(r), "");
    return std::move(r.scene);
  };
  const SceneDescription still = load(1, 0), moving = load(1, 1.0 / 48);
  EXPECT_EQ(still.shapes.size(), 3u);
  EXPECT_EQ(still.instances.size(), 4u) << "the sails";
  EXPECT_EQ(std::ranges::count_if(moving.instances, [](const auto& i) { return i.moves_to >= 0; }), 4);
  EXPECT_EQ(
      std::ranges::count_if(moving.shapes,
                            [](const auto& s) { return !std::get<MeshShape>(s.kind).mesh->later.empty(); }),
      2)
      << "the hill and the pennant";
}

TEST(OwnScenes, TheGlassBallIsHollow) {
  const LoadResult r = load_path(fs::path(LIGHTMILL_SOURCE_DIR) / "scenes/cornell-spheres.pbrt");
  std::vector<const ShapeDescription*> glass;
  for (const ShapeDescription& s : r.scene.shapes) {
    if (std::holds_alternative<DielectricMaterial>(r.scene.materials[static_cast<size_t>(s.material)].kind))
      glass.push_back(&s);
  }
  ASSERT_EQ(glass.size(), 2u);
  EXPECT_FALSE(surface_flips_normal(*glass[0]));
  EXPECT_TRUE(surface_flips_normal(*glass[1]));
  EXPECT_GT(std::get<SphereShape>(glass[0]->kind).radius, std::get<SphereShape>(glass[1]->kind).radius);
}

struct Shared {
  const char* name;
  size_t min_triangles, materials, area_lights;
  int width, height;
};
void PrintTo(const Shared& s, std::ostream* out) { *out << s.name; }

class SharedScenes : public testing::TestWithParam<Shared> {};
INSTANTIATE_TEST_SUITE_P(All, SharedScenes,
                         testing::Values(Shared{"cornell-box", 30, 8, 1, 1024, 1024},
                                         Shared{"veach-mis", 50, 6, 3, 1280, 720},
                                         Shared{"veach-bidir", 11000, 4, 2, 1024, 1024},
                                         Shared{"coffee", 230000, 5, 3, 800, 1000},
                                         Shared{"veach-ajar", 380000, 13, 1, 1280, 720},
                                         Shared{"water-caustic", 100000, 9, 1, 1024, 1024},
                                         Shared{"kitchen", 1400000, 80, 4, 1280, 720}));

TEST_P(SharedScenes, LoadWithoutErrors) {
  const Shared& expected = GetParam();
  const fs::path path = fs::path(LIGHTMILL_SOURCE_DIR) / "../shared/scenes" / expected.name / "scene-v4.pbrt";
  if (!fs::exists(path)) GTEST_SKIP() << "the shared scenes are not beside this checkout";
  const LoadResult r = load_path(path);
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_GE(triangles(r.scene), expected.min_triangles);
  EXPECT_GE(r.scene.materials.size(), expected.materials);
  EXPECT_EQ(r.scene.area_lights.size(), expected.area_lights);
  EXPECT_EQ(r.scene.film.width, expected.width);
  EXPECT_EQ(r.scene.film.height, expected.height);
  for (const ShapeDescription& s : r.scene.shapes) {
    EXPECT_GE(s.material, 0);
    EXPECT_LT(s.material, static_cast<int>(r.scene.materials.size()));
  }
}

}  // namespace
}  // namespace lightmill
