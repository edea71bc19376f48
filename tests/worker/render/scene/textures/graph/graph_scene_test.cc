// Texture graphs in scenes: programs, constants, images, and the picture.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "common/base/error.h"
#include "common/image/image.h"
#include "common/scene/load.h"
#include "common/scene/texture_graph/read_graph.h"
#include "tests/support/render.h"
#include "tests/support/temporary_folder.h"
#include "worker/render/scene/render_scene.h"
#include "worker/render/scene/textures/graph/constant_graphs.h"
#include "worker/render/scene/textures/graph/graph_program.h"

namespace lightmill::test {
namespace {

TextureGraph graph_of(const std::string& nodes, const std::string& output) {
  return read_texture_graph(R"({"texture_graph": 1, "nodes": [)" + nodes + R"(], "output": )" + output + "}",
                            {})
      .graph;
}

TEST(GraphProgram, FoldsConstantsAndDropsWhatIsNotNeeded) {
  const GraphProgram program(graph_of(R"(
      {"name": "a", "type": "VALUE", "value": 0.5},
      {"name": "unused", "type": "TEX_VORONOI"},
      {"name": "b", "type": "MATH", "operation": "SINE", "inputs": {"Value": ["a", "Value"]}},
      {"name": "c", "type": "TEX_NOISE", "inputs": {"Vector": ["b", "Value"]}})",
                                      R"(["c", "Fac"])"),
                             {});
  EXPECT_EQ(program.operations(), 0u);
  ASSERT_TRUE(program.constant());
  EXPECT_GT(program.constant()->r, 0);
  EXPECT_FALSE(
      GraphProgram(graph_of(R"({"name": "a", "type": "TEX_CHECKER"})", R"(["a", "Fac"])"), {}).constant());
}

// Wild operands and wild points: finite values, and the same bits on one lane and on eight.
TEST(GraphProgram, IsFiniteEverywhere) {
  const float wild[] = {0,      -0.0f, 1e30f, -1e30f, std::numeric_limits<float>::infinity(), std::nanf(""),
                        1e-40f, 3e9f};
  TexturePoint at[8];
  for (size_t i = 0; i < 8; ++i) {
    at[i].color = {wild[i], wild[(i + 3) % 8], wild[(i + 5) % 8], wild[(i + 1) % 8]};
    at[i].u = wild[(i + 2) % 8], at[i].v = wild[(i + 7) % 8];
  }
  const TextureTable no_images({});
  for (int op = static_cast<int>(GraphOp::kAdd); op < static_cast<int>(GraphOp::kCount); ++op) {
    if (op == static_cast<int>(GraphOp::kTable) || op == static_cast<int>(GraphOp::kSteps)) continue;
    for (int dimensions = 1; dimensions <= 4; ++dimensions) {
      for (int kind = 0; kind < 5; ++kind) {
        TextureGraph g;
        for (int k = 0; k < 6; ++k) g.operations.push_back({GraphOp::kInput, 0, k, k, 0, 0});
        GraphOperation o{static_cast<GraphOp>(op), 0, 6, dimensions, kind, kind % 4};
        for (int32_t k = 0; k < kMostOperands; ++k) g.operands.push_back((k + kind) % 6);
        g.operations.push_back(o);
        g.results = 6 + shape_of(o.op).results;
        const int32_t last = g.results - 1;
        g.output = {6, last, last};
        const GraphProgram program(g, {});
        Float8 lanes[3];
        program.evaluate(no_images, at, lanes);
        for (size_t i = 0; i < 8; ++i) {
          float value[3];
          program.evaluate(no_images, &at[i], value);
          for (size_t k = 0; k < 3; ++k) {
            ASSERT_TRUE(std::isfinite(value[k])) << op << " " << dimensions << " " << kind;
            ASSERT_EQ(value[k], lanes[k][i]) << op << " " << dimensions << " " << kind << " " << i;
          }
        }
      }
    }
  }
}

TEST(GraphProgram, RefusesMoreValuesAtOnceThanThereAreRegisters) {
  std::string nodes, sum = R"({"name": "s0", "type": "VALUE", "value": 0})";
  for (int i = 1; i <= 300; ++i) {
    const std::string n = std::to_string(i), before = std::to_string(i - 1);
    nodes += R"({"name": "w)" + n + R"(", "type": "TEX_NOISE", "inputs": {"Scale": )" + n + "}},";
    sum += R"(,{"name": "s)" + n + R"(", "type": "MATH", "inputs": {"Value": ["s)" + before +
           R"(", "Value"], "Value_001": ["w)" + n + R"(", "Fac"]}})";
  }
  EXPECT_THROW(GraphProgram(graph_of(nodes + sum, R"(["s300", "Value"])"), {}), Error);
}

class GraphScene : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_.file(name)) << text; }
  /// A lit quad that fills the picture and shows the graph.
  SceneDescription scene(const std::string& graph) {
    write("graph.json", graph);
    write("scene.pbrt", R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
      PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
      LookAt 0 0 -1  0 0 0  0 1 0
      Camera "orthographic"
      WorldBegin
      LightSource "infinite" "rgb L" [1 1 1]
      Texture "t" "spectrum" "graph" "string filename" "graph.json"
      Material "diffuse" "texture reflectance" "t"
      Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 0] "point2 uv" [0 0 1 0 0 1 1 1])");
    LoadResult result = load_scene("scene.pbrt", DirectoryFiles(folder_.file("")), {});
    for (const Problem& p : result.problems) ADD_FAILURE() << format_problem(p);
    return result.scene;
  }
  Rgb mean(const SceneDescription& s) {
    const Batches b = render_batches(s, settings_for(s, Integrator::kPt, 64, 2), 1);
    return {static_cast<float>(b.mean(0).mean), static_cast<float>(b.mean(1).mean),
            static_cast<float>(b.mean(2).mean)};
  }
  TemporaryFolder folder_;
};

// Half of the squares are of one colour, half of the other.
TEST_F(GraphScene, RendersToTheMeanOfAChecker) {
  const SceneDescription s = scene(R"({"texture_graph": 1, "nodes": [
    {"name": "at", "type": "TEX_COORD"},
    {"name": "board", "type": "TEX_CHECKER", "inputs": {"Vector": ["at", "UV"], "Scale": 8, "Color1": [0.8, 0.2, 0.4], "Color2": [0.2, 0.6, 0]}}],
    "output": ["board", "Color"]})");
  const Rgb c = mean(s);
  EXPECT_NEAR(c.r, 0.5f, 0.005f);
  EXPECT_NEAR(c.g, 0.4f, 0.005f);
  EXPECT_NEAR(c.b, 0.2f, 0.005f);
}

// u over the quad, through maths, as a colour: 1/2, 1/3 and 1/4.
TEST_F(GraphScene, RendersToTheMeansOfPowers) {
  const SceneDescription s = scene(R"({"texture_graph": 1, "nodes": [
    {"name": "at", "type": "UVMAP"}, {"name": "u", "type": "SEPXYZ", "inputs": {"Vector": ["at", "UV"]}},
    {"name": "u2", "type": "MATH", "operation": "POWER", "inputs": {"Value": ["u", "X"], "Value_001": 2}},
    {"name": "u3", "type": "MATH", "operation": "MULTIPLY", "inputs": {"Value": ["u", "X"], "Value_001": ["u2", "Value"]}},
    {"name": "c", "type": "COMBXYZ", "inputs": {"X": ["u", "X"], "Y": ["u2", "Value"], "Z": ["u3", "Value"]}}],
    "output": ["c", "Vector"]})");
  const Rgb c = mean(s);
  EXPECT_NEAR(c.r, 1 / 2.0, 0.005);
  EXPECT_NEAR(c.g, 1 / 3.0, 0.005);
  EXPECT_NEAR(c.b, 1 / 4.0, 0.005);
}

TEST_F(GraphScene, ShowsImagesAndListsThemForTheBundle) {
  Image image(2, 1);
  for (int c = 0; c < 3; ++c) image.pixel(0, 0)[c] = 0.2f, image.pixel(1, 0)[c] = 0.6f;
  write_image(image, folder_.file("halves.exr"));
  const SceneDescription s = scene(R"({"texture_graph": 1, "nodes": [
    {"name": "i", "type": "TEX_IMAGE", "image": "halves.exr", "interpolation": "Closest", "colorspace": "Non-Color"},
    {"name": "n", "type": "INVERT", "inputs": {"Color": ["i", "Color"]}}],
    "output": ["n", "Color"]})");
  std::vector<std::string> names;
  for (const SourceFile& f : s.files) names.push_back(f.name);
  EXPECT_EQ(names, (std::vector<std::string>{"scene.pbrt", "graph.json", "halves.exr"}));
  EXPECT_NEAR(mean(s).r, 0.6f, 0.005f);
}

TEST_F(GraphScene, AConstantGraphIsNoTexture) {
  const SceneDescription s = scene(R"({"texture_graph": 1, "nodes": [
    {"name": "a", "type": "MATH", "operation": "SQRT", "inputs": {"Value": 0.25}}], "output": ["a", "Value"]})");
  EXPECT_FALSE(build_scene(s).any_texture);
  EXPECT_NEAR(mean(s).r, 0.5f, 0.005f);
}

}  // namespace
}  // namespace lightmill::test
