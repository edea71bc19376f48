// Every node of a texture graph against what Blender's Cycles gives (make_values.py), on one lane and on
// eight.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "common/scene/texture_graph/read_graph.h"
#include "tests/support/temporary_folder.h"
#include "worker/render/scene/textures/graph/graph_program.h"

namespace lightmill::test {
namespace {

using nlohmann::json;

constexpr double kTolerance = 5e-5;  // of the value, or of 1 if that is more; custom normals have 16 bits

/// As make_values.py has it; its first row is the lowest.
void write_picture(const std::string& file) {
  Image image(8, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) {
      float* texel = image.pixel(x, 3 - y);
      texel[0] = static_cast<float>((x * 3 + y * 5) % 7) / 8;
      texel[1] = static_cast<float>((x + 2 * y) % 5) / 8;
      texel[2] = static_cast<float>(x) / 8;
    }
  }
  write_image(image, file);
}

TEST(TextureGraph, HasTheValuesOfBlender) {
  std::ifstream file(LIGHTMILL_SOURCE_DIR "/tests/worker/render/scene/textures/graph/blender_values.json");
  const json all = json::parse(file);
  const size_t points = all["points"].size();
  ASSERT_LE(points, 8u);
  TexturePoint at[8];
  for (size_t i = 0; i < 8; ++i) {
    const json& p = all["points"][i % points];
    at[i].color = {p[0], p[1], p[2], 1};
    at[i].u = p[3], at[i].v = p[4];
    const json& n = all["normals"][i % points];
    at[i].ns = {n[0], n[1], n[2]};
  }
  const TemporaryFolder folder;
  write_picture(folder.file("image.exr"));
  size_t cases = 0;
  for (const json& one : all["cases"]) {
    json nodes = all["base"];
    nodes.push_back(one["node"]);
    const json graph = {{"texture_graph", 1}, {"nodes", nodes}, {"output", one["output"]}};
    const GraphFile read = read_texture_graph(graph.dump(), {});
    std::vector<TextureDescription> images;
    std::vector<int> numbers;
    for (const GraphImage& image : read.images) {
      numbers.push_back(static_cast<int>(images.size()));
      ImageTexture t;
      t.path = folder.file(image.file);
      t.filter = image.filter;
      t.wrap = image.extension == "EXTEND" ? Wrap::kClamp : Wrap::kRepeat;
      images.push_back({"", true, t, {}});
    }
    const TextureTable table(images);
    const GraphProgram program(read.graph, numbers);
    Float8 lanes[3];
    program.evaluate(table, at, lanes);
    for (size_t i = 0; i < points; ++i) {
      float value[3];
      program.evaluate(table, &at[i], value);
      for (size_t k = 0; k < 3; ++k) {
        const double theirs = one["values"][i][k];
        EXPECT_NEAR(value[k], theirs, kTolerance * std::max(1.0, std::fabs(theirs)))
            << one["name"] << ", point " << i << ", channel " << k;
        EXPECT_EQ(std::bit_cast<uint32_t>(value[k]), std::bit_cast<uint32_t>(lanes[k][i])) << one["name"];
      }
    }
    ++cases;
  }
  EXPECT_GT(cases, 300u);
}

}  // namespace
}  // namespace lightmill::test
