// The reader of texture graphs: what it refuses, and how it says so.
#include "common/scene/texture_graph/read_graph.h"

#include <gmock/gmock.h>

#include "common/base/error.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

std::string file_of(const std::string& nodes, const std::string& output) {
  return R"({"texture_graph": 1, "nodes": [)" + nodes + R"(], "output": )" + output + "}";
}
/// What is said of a text; empty: it is read.
std::string complaint(const std::string& text) {
  try {
    read_texture_graph(text, {});
    return "";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kBadScene);
    return e.what();
  }
}
std::string complaint_of(const std::string& nodes, const std::string& output = R"(["a", "Value"])") {
  return complaint(file_of(nodes, output));
}

TEST(ReadGraph, OperationsAreFlatAndReadWhatComesBefore) {
  const TextureGraph g = read_texture_graph(file_of(R"({"name": "x", "type": "TEX_NOISE"},
      {"name": "a", "type": "MATH", "operation": "MULTIPLY", "inputs": {"Value": ["x", "Fac"], "Value_001": 3}})",
                                                    R"(["a", "Value"])"),
                                            {})
                             .graph;
  int32_t known = 0;
  for (const GraphOperation& o : g.operations) {
    EXPECT_EQ(o.first_result, known);
    for (int32_t k = 0; k < shape_of(o.op).operands; ++k)
      EXPECT_LT(g.operands.at(static_cast<size_t>(o.first_operand + k)), known);
    known += shape_of(o.op).results;
  }
  EXPECT_EQ(known, g.results);
  EXPECT_EQ(g.output[0], known - 1);
}

TEST(ReadGraph, WhatIsWrongIsSaidWithTheNode) {
  EXPECT_THAT(
      complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Value": ["a", "Value"]}})"),
      HasSubstr(
          "the node \"a\": input \"Value\" reads the node \"a\", which is the node itself or comes later"));
  EXPECT_THAT(
      complaint_of(
          R"({"name": "a", "type": "MATH", "inputs": {"Value": ["b", "Value"]}}, {"name": "b", "type": "VALUE"})"),
      HasSubstr("comes later"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Value": ["c", "Value"]}})"),
              HasSubstr("\"c\", which is not there"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "VALUE"}, {"name": "a", "type": "VALUE"})"),
              HasSubstr("two nodes are named \"a\""));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATHS"})"), HasSubstr("unknown type \"MATHS\""));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "operation": "SINUS"})"),
              HasSubstr("\"SINUS\", which is not supported"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Fac": 1}})"),
              HasSubstr("an input \"Fac\", which is unknown"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "colour": 1})"),
              HasSubstr("a parameter \"colour\", which is unknown"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Value": "x"}})"),
              HasSubstr("needs a number"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Value": [1, 2, "x"]}})"),
              HasSubstr("numbers"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "MATH", "inputs": {"Value": 1e300}})"),
              HasSubstr("beyond 1e30"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "VALUE"})", R"(["a", "Color"])"),
              HasSubstr("no such output"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "VALTORGB", "elements": []})"),
              HasSubstr("\"elements\""));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "CURVE_FLOAT", "tables": [[1]]})"), HasSubstr("numbers"));
  EXPECT_THAT(complaint_of(R"({"type": "VALUE"})"), HasSubstr("needs a \"name\""));
}

TEST(ReadGraph, WhatIsNotSupportedIsSaidByName) {
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "CAMERA"})"),
              HasSubstr("(CAMERA) is not supported: it depends on the camera"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "NEW_GEOMETRY"})", R"(["a", "Pointiness"])"),
              HasSubstr("\"Pointiness\" of the node \"a\", which is not supported"));
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "TEX_IMAGE", "image": "x.png", "projection": "BALL"})",
                           R"(["a", "Color"])"),
              HasSubstr("\"BALL\", which is not supported"));
}

TEST(ReadGraph, WhatStrangersCouldMakeCostlyIsBounded) {
  EXPECT_THAT(complaint(std::string(5u << 20, ' ')), HasSubstr("MiB"));
  EXPECT_THAT(complaint(std::string(100000, '[')), HasSubstr("deep"));
  EXPECT_THAT(complaint_of(R"({"name": ")" + std::string(300, 'n') + R"(", "type": "VALUE"})"),
              HasSubstr("256 bytes"));
  std::string cells;
  for (int i = 0; i < 200; ++i) {
    const std::string from = i == 0 ? "1" : "[\"v" + std::to_string(i - 1) + "\", \"Distance\"]";
    cells +=
        R"({"name": "v)" + std::to_string(i) +
        R"(", "type": "TEX_VORONOI", "voronoi_dimensions": "4D", "feature": "SMOOTH_F1", "inputs": {"W": )" +
        from + "}},";
  }
  EXPECT_THAT(complaint_of(cells + R"({"name": "a", "type": "VALUE"})", R"(["v199", "Distance"])"),
              HasSubstr("cells of noise"));
  std::string many = R"({"name": "a", "type": "VALUE"})", curve = "0", images;
  for (int i = 0; i < 1100; ++i) many += R"(,{"name": "n)" + std::to_string(i) + R"(", "type": "VALUE"})";
  EXPECT_THAT(complaint_of(many), HasSubstr("at most 1024 nodes"));
  for (int i = 0; i < 5000; ++i) curve += ",0";
  EXPECT_THAT(complaint_of(R"({"name": "a", "type": "CURVE_FLOAT", "tables": [[)" + curve + "]]}"),
              HasSubstr("2 to 4096 numbers"));
  for (int i = 0; i < 100; ++i)
    images += R"({"name": "i)" + std::to_string(i) + R"(", "type": "TEX_IMAGE", "image": "x.png"},)";
  EXPECT_THAT(complaint_of(images + R"({"name": "a", "type": "VALUE"})"), HasSubstr("64 at most"));
}

TEST(ReadGraph, DamagedTextsAreRefusedAndHarmless) {
  const std::string good = file_of(
      R"({"name": "n", "type": "TEX_NOISE", "noise_dimensions": "4D", "inputs": {"Scale": 3, "Vector": [1, 2, 3]}},
      {"name": "r", "type": "VALTORGB", "elements": [{"position": 0, "color": [0, 0, 0, 1]}], "inputs": {"Fac": ["n", "Fac"]}},
      {"name": "a", "type": "MIX_RGB", "inputs": {"Color1": ["r", "Color"]}})",
      R"(["a", "Color"])");
  EXPECT_EQ(complaint(good), "");
  for (size_t i = 0; i < good.size(); ++i) {
    EXPECT_NE(complaint(good.substr(0, i)), "");
    std::string changed = good;
    for (const char c : {'"', '9', '[', '-', '\0', '\xff'}) {
      changed[i] = c;
      complaint(changed);  // refused or not: no crash
    }
  }
}

class GraphInPbrt : public SceneTest {};

TEST_F(GraphInPbrt, IsReadWithItsPlaceInTheSceneFile) {
  folder_.write("g.json", file_of(R"({"name": "a", "type": "VALUE", "value": 2})", R"(["a", "Value"])"));
  const SceneDescription scene = clean_world(R"(Texture "t" "float" "graph" "string filename" "g.json")");
  ASSERT_TRUE(std::holds_alternative<GraphTexture>(scene.textures.at(0).kind));
  folder_.write("g.json", file_of(R"({"name": "a", "type": "OBJECT_INFO"})", R"(["a", "Random"])"));
  const LoadResult bad = load_world(R"(Texture "t" "float" "graph" "string filename" "g.json")");
  ASSERT_EQ(bad.problems.size(), 1u);
  EXPECT_EQ(bad.problems[0].where.line, 2);
  EXPECT_THAT(bad.problems[0].message,
              HasSubstr("the texture graph \"g.json\": the node \"a\" (OBJECT_INFO) is not supported"));
}

}  // namespace
}  // namespace lightmill
