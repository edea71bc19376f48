// Nodes that say where a surface is hit, and constants.
#include <nlohmann/json.hpp>

#include "common/scene/texture_graph/graph_json.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr const char* kNeedsView = "it depends on the camera, which textures don't know";
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

GraphVector normal_in_world(GraphContext& c) {
  return turned(c.to_world, inputs(c.builder, GraphInput::kNormalX));
}
GraphVector incoming_in_world(GraphContext& c) {
  return turned(c.world, inputs(c.builder, GraphInput::kIncomingX));
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
  const GraphVector normal = normal_in_world(c), incoming = incoming_in_world(c);
  node.out_vector("Reflection", normal * (dot(normal, incoming) * 2.0f) - incoming);
}

void read_uv_map(GraphNode& node) {
  node.text("uv_map");  // a label: meshes number their sets
  node.out_vector("UV", uv_of(node, node.parameter("uv_set", 0, 0, 1) == 1));
}

void read_geometry(GraphNode& node) {
  GraphContext& c = node.graph();
  node.out_vector("Position", c.builder.point(c.spaces["world"]));
  node.out_vector("Normal", normal_in_world(c));
  node.out_vector("True Normal", turned(c.to_world, inputs(node.builder(), GraphInput::kTrueNormalX)));
  node.out_vector("Incoming", incoming_in_world(c));
  node.out("Backfacing", node.builder().input(GraphInput::kBackfacing));
  node.no_output("Tangent", "tangents are not known here");
  node.no_output("Parametric", "what a point is within its triangle is not known here");
  node.no_output("Pointiness", "what the mesh looks like around the point is not known here");
  node.no_output("Random Per Island", "the parts of a mesh are not known here");
}

/// |cos| of the angle between the ray and the node's Normal.
GraphNumber facing_cosine(GraphNode& node) {
  GraphContext& c = node.graph();
  const GraphVector given = node.vector("Normal", 0, 0, 0);
  const GraphVector n = node.has_input("Normal") ? normalized(given) : normal_in_world(c);
  return minimum(absolute(dot(n, incoming_in_world(c))), c.builder.constant(1));
}

/// Reflectance of a dielectric of relative index `eta`.
GraphNumber fresnel(const GraphNumber& cosine, const GraphNumber& eta) {
  const GraphNumber g2 = eta * eta - 1.0f + cosine * cosine,
                    g = square_root(maximum(g2, g2.builder->constant(0)));
  const GraphNumber a = (g - cosine) / (g + cosine);
  const GraphNumber b = (cosine * (g + cosine) - 1.0f) / (cosine * (g - cosine) + 1.0f);
  return choose(g2, a * a * (b * b + 1.0f) * 0.5f, g2.builder->constant(1));
}

void read_fresnel(GraphNode& node) {
  GraphBuilder& g = node.builder();
  const GraphNumber ior = maximum(node.number("IOR", 1.45f), g.constant(1e-5f));
  const GraphNumber eta = choose(g.input(GraphInput::kBackfacing), g.constant(1) / ior, ior);
  node.out("Fac", fresnel(facing_cosine(node), eta));
}

void read_layer_weight(GraphNode& node) {
  GraphBuilder& g = node.builder();
  const GraphNumber blend = node.number("Blend", 0.5f), cosine = facing_cosine(node);
  const GraphNumber eta = maximum(1.0f - blend, g.constant(1e-5f));
  node.out("Fresnel", fresnel(cosine, choose(g.input(GraphInput::kBackfacing), eta, g.constant(1) / eta)));
  const GraphNumber b = minimum(maximum(blend, g.constant(0)), g.constant(1 - 1e-5f));
  const GraphNumber exponent = choose(g.constant(0.5f) - b, b * 2.0f, g.constant(0.5f) / (1.0f - b));
  node.out("Facing", 1.0f - apply(GraphOp::kPower, cosine, exponent));
}

void read_light_path(GraphNode& node) {
  GraphBuilder& g = node.builder();
  node.out("Is Camera Ray", g.input(GraphInput::kIsCameraRay));
  node.out("Is Shadow Ray", g.input(GraphInput::kIsShadowRay));
  node.out("Is Diffuse Ray", g.input(GraphInput::kIsDiffuseRay));
  node.out("Is Glossy Ray", g.input(GraphInput::kIsGlossyRay));
  node.out("Is Singular Ray", g.input(GraphInput::kIsSingularRay));
  node.out("Is Reflection Ray", g.input(GraphInput::kIsReflectionRay));
  node.out("Is Transmission Ray", g.input(GraphInput::kIsTransmissionRay));
  node.out("Ray Length", g.input(GraphInput::kRayLength));
  node.out("Ray Depth", g.input(GraphInput::kRayDepth));
  for (const char* depth : {"Diffuse Depth", "Glossy Depth", "Transparent Depth", "Transmission Depth"})
    node.no_output(depth, "how often a path was scattered is known, but not in which way");
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
          {"FRESNEL", read_fresnel},
          {"LAYER_WEIGHT", read_layer_weight},
          {"LIGHT_PATH", read_light_path},
          {"CAMERA", nullptr, kNeedsView},
          {"LIGHT_FALLOFF", nullptr, "it belongs to a lamp"},
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
