// Every node of a texture graph against what Blender's Cycles gives (make_values.py), on one lane and on
// eight.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/scene/texture_graph/read_graph.h"
#include "worker/render/scene/textures/graph/graph_program.h"

namespace lightmill::test {
namespace {

using nlohmann::json;

constexpr double kTolerance = 1e-5;  // of the value, or of 1 if that is more

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
  }
  const TextureTable no_images({});
  size_t cases = 0;
  for (const json& one : all["cases"]) {
    json nodes = all["base"];
    nodes.push_back(one["node"]);
    const json graph = {{"texture_graph", 1}, {"nodes", nodes}, {"output", one["output"]}};
    const GraphProgram program(read_texture_graph(graph.dump(), {}).graph, {});
    Float8 lanes[3];
    program.evaluate(no_images, at, lanes);
    for (size_t i = 0; i < points; ++i) {
      float value[3];
      program.evaluate(no_images, &at[i], value);
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
