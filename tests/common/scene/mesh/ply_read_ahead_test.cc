// Reading meshes ahead: the guess of file names, and that threads show neither in scenes nor in messages.
#include "common/scene/mesh/ply_read_ahead.h"

#include "common/base/error.h"
#include "common/scene/mesh/ply_reader.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

/// A strip of triangles over `vertices` vertices; `flat` triangles without area follow.
std::string strip(int vertices, int flat = 0) {
  std::string out = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(vertices - 2 + flat) +
                    "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < vertices; ++i) out += std::to_string(i) + " " + std::to_string(i % 2) + " 0\n";
  for (int i = 2; i < vertices; ++i)
    out.append("3 ").append(std::to_string(i - 2) + " " + std::to_string(i - 1) + " " + std::to_string(i) +
                            "\n");
  for (int i = 0; i < flat; ++i) out += "3 0 0 1\n";
  return out;
}

TEST(PlymeshFiles, ListsNamesInOrder) {
  const auto found = plymesh_files(R"(Shape "plymesh" "string filename" [ "a b.ply" ]
      # Shape "plymesh" "string filename" "old.ply"
      Shape "sphere" "float radius" 2   Shape "plymesh" "float edgelength" 1
      Shape "plymesh" "string filename" "c.ply" Shape "plymesh" "string filename" "cut)");
  EXPECT_EQ(found, (std::vector<std::string>{"a b.ply", "old.ply", "c.ply"}));
}

TEST(PlyReadAhead, GivesWhatReadingGives) {
  const TempFolder folder;
  std::vector<std::string> paths;
  for (int i = 0; i < 40; ++i)
    paths.push_back(folder.write(std::to_string(i) + ".ply", strip(3 + 50 * i, i % 3)));
  for (const int threads : {1, 2, 5}) {
    PlyReadAhead ahead(threads);
    ahead.expect(paths);
    ahead.expect(paths);
    for (size_t i = paths.size(); i-- > 0;) {  // not in the order expected
      const CleanMesh read = ahead.take(paths[i]);
      EXPECT_EQ(read.mesh.triangles.size(), 1 + 50 * i);
      EXPECT_EQ(read.dropped_triangles, i % 3);
    }
    const std::string other = folder.write("other.ply", strip(9));
    EXPECT_EQ(ahead.take(other).mesh.positions.size(), 9u) << "not expected";
  }
}

TEST(PlyReadAhead, AnErrorIsThrownWhereItsFileIsTaken) {
  const TempFolder folder;
  const std::string good = folder.write("good.ply", strip(5)), bad = folder.write("bad.ply", "plx\n");
  PlyReadAhead ahead(3);
  ahead.expect({bad, good, folder.path() + "/none.ply", folder.path()});
  EXPECT_EQ(ahead.take(good).mesh.positions.size(), 5u);
  EXPECT_THROW(ahead.take(bad), Error);
}

TEST(PlyReadAhead, WhatNobodyTakesIsLeft) {
  const TempFolder folder;
  PlyReadAhead ahead(4);
  ahead.expect({folder.write("a.ply", strip(500)), folder.write("b.ply", strip(500))});
}

using ReadAheadScene = SceneTest;

TEST_F(ReadAheadScene, MessagesComeInFileOrderWhateverTheThreads) {
  std::string world, nested;
  for (int i = 0; i < 30; ++i) {
    const std::string name = std::string("m") + std::to_string(i) + ".ply";
    folder_.write(name, i % 7 == 3 ? "ply\nbroken" : strip(3 + 20 * (30 - i), i % 2));
    (i % 3 == 0 ? nested : world) += "Shape \"plymesh\" \"string filename\" \"" + name + "\"\n";
  }
  folder_.write("nested.pbrt", nested + "Shape \"plymesh\" \"string filename\" \"none.ply\"\n");
  const LoadResult one = load_world("Include \"nested.pbrt\"\n" + world, {.threads = 1});
  EXPECT_TRUE(mentions(one, "none.ply"));
  EXPECT_TRUE(mentions(one, "without area"));
  for (int run = 0; run < 10; ++run) {
    const LoadResult many = load_world("Include \"nested.pbrt\"\n" + world, {.threads = 4});
    ASSERT_EQ(listed(many), listed(one));
    ASSERT_EQ(many.scene.shapes.size(), one.scene.shapes.size());
    for (size_t i = 0; i < one.scene.shapes.size(); ++i) {
      EXPECT_EQ(std::get<MeshShape>(many.scene.shapes[i].kind).mesh->triangles,
                std::get<MeshShape>(one.scene.shapes[i].kind).mesh->triangles);
    }
  }
}

}  // namespace
}  // namespace lightmill
