// Nodes that say where a surface is hit, and constants.
#include <nlohmann/json.hpp>

#include "common/scene/texture_graph/graph_json.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr const char* kNeedsRay =
    "it depends on the ray that meets the surface, which textures don't know; paths from both sides could "
    "not be joined";
constexpr const char* kNeedsObject =
    "the objects of a scene are not known here; write what is known as VALUE or RGB nodes";

GraphVector inputs(GraphBuilder& g, GraphInput first) {
  const auto input = [&](int k) { return g.input(static_cast<GraphInput>(static_cast<int>(first) + k)); };
  return {input(0), input(1), input(2)};
}

/// A direction of the scene's space, which `m` leads to.
GraphVector turned(const Transform& m, const GraphVector& v) {
  const auto row = [&](size_t i) {
    const auto at = [&](size_t k) { return static_cast<float>(m.m[i][k]); };
    return v.x * at(0) + v.y * at(1) + v.z * at(2);
  };
  return normalized({row(0), row(1), row(2)});
}

GraphVector uv_of(GraphNode& node, bool second) {
  GraphBuilder& g = node.builder();
  return {g.input(second ? GraphInput::kSecondU : GraphInput::kU),
          g.input(second ? GraphInput::kSecondV : GraphInput::kV), g.constant(0)};
}

void read_coordinates(GraphNode& node) {
  GraphContext& c = node.graph();
  node.out_vector("Generated", c.builder.point(c.spaces["generated"]));
  node.out_vector("Object", c.builder.point(c.spaces["object"]));
  node.out_vector("UV", uv_of(node, false));
  node.out_vector("Normal", object_normal(c));
  if (const auto camera = c.spaces.find("camera"); camera != c.spaces.end()) {
    node.out_vector("Camera", c.builder.point(camera->second));
  } else {
    node.no_output("Camera", "the graph gives no space \"camera\"");
  }
  node.no_output("Window", "the camera's projection is not known here");
  node.no_output("Reflection", kNeedsRay);
}

void read_uv_map(GraphNode& node) {
  node.text("uv_map");  // a label: meshes number their sets
  node.out_vector("UV", uv_of(node, node.parameter("uv_set", 0, 0, 1) == 1));
}

void read_geometry(GraphNode& node) {
  GraphContext& c = node.graph();
  node.out_vector("Position", c.builder.point(c.spaces["world"]));
  node.out_vector("Normal", turned(c.to_world, inputs(node.builder(), GraphInput::kNormalX)));
  node.out_vector("True Normal", turned(c.to_world, inputs(node.builder(), GraphInput::kTrueNormalX)));
  node.no_output("Incoming", kNeedsRay);
  node.no_output("Backfacing", kNeedsRay);
  node.no_output("Tangent", "tangents are not known here");
  node.no_output("Parametric", "what a point is within its triangle is not known here");
  node.no_output("Pointiness", "what the mesh looks like around the point is not known here");
  node.no_output("Random Per Island", "the parts of a mesh are not known here");
}

void read_attribute(GraphNode& node) {
  node.text("attribute_name"), node.text("layer_name");  // labels: a mesh has one set of colours
  const GraphVector color = inputs(node.builder(), GraphInput::kRed);
  node.out_color("Color", color);
  node.out_vector("Vector", color);
  node.out("Fac", (color.x + color.y + color.z) * (1.0f / 3.0f));
  node.out("Alpha", node.builder().input(GraphInput::kAlpha));
}

void read_value(GraphNode& node) {
  node.out("Value", node.builder().constant(static_cast<float>(node.parameter("value", 0, -1e30, 1e30))));
}

void read_rgb(GraphNode& node) {
  const nlohmann::json* given = node.member("color");
  if (!given) node.fail("needs a \"color\"");
  const std::vector<double> c = node.numbers(*given, "\"color\"", 3, 4);
  node.out_color("Color", node.builder().constant(static_cast<float>(c[0]), static_cast<float>(c[1]),
                                                  static_cast<float>(c[2])));
}

}  // namespace

GraphVector texture_vector(GraphNode& node) {
  GraphContext& c = node.graph();
  const GraphVector given = node.vector("Vector", 0, 0, 0);
  return node.has_input("Vector") ? given : c.builder.point(c.spaces["generated"]);
}

GraphVector object_normal(GraphContext& graph) {
  return turned(graph.to_object_normals, inputs(graph.builder, GraphInput::kNormalX));
}

Transform for_normals(const Transform& t) {
  const Transform back = inverse(t);
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) out.m[i][k] = back.m[k][i];
  }
  return out;
}

std::vector<GraphNodeType> input_node_types() {
  return {{"TEX_COORD", read_coordinates},
          {"UVMAP", read_uv_map},
          {"NEW_GEOMETRY", read_geometry},
          {"ATTRIBUTE", read_attribute},
          {"VERTEX_COLOR", read_attribute},
          {"VALUE", read_value},
          {"RGB", read_rgb},
          {"FRESNEL", nullptr, kNeedsRay},
          {"LAYER_WEIGHT", nullptr, kNeedsRay},
          {"LIGHT_PATH", nullptr, kNeedsRay},
          {"CAMERA", nullptr, kNeedsRay},
          {"LIGHT_FALLOFF", nullptr, kNeedsRay},
          {"OBJECT_INFO", nullptr, kNeedsObject},
          {"PARTICLE_INFO", nullptr, kNeedsObject},
          {"POINT_INFO", nullptr, kNeedsObject},
          {"HAIR_INFO", nullptr, "where on its strand a point is, is not known here"},
          {"TANGENT", nullptr, "tangents are not known here"},
          {"WIREFRAME", nullptr, "the edges of a mesh are not known here"},
          {"AMBIENT_OCCLUSION", nullptr, "a texture traces no rays"},
          {"BEVEL", nullptr, "a texture traces no rays"},
          {"SHADERTORGB", nullptr, "a texture knows no light"},
          {"BUMP", nullptr, "it makes a normal; give its height to a material as its displacement"},
          {"NORMAL_MAP", nullptr, "it makes a normal; give its colour to a material as its normal map"},
          {"DISPLACEMENT", nullptr, "it is no texture; give its height to a material as its displacement"},
          {"VECTOR_DISPLACEMENT", nullptr, "it is no texture"},
          {"GROUP", nullptr, "write the nodes of the group in its place"},
          {"SCRIPT", nullptr, "scripts are not run"}};
}

}  // namespace lightmill
