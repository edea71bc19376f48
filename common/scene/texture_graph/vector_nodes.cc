// Vectors: mapping, rotation, vector maths.
#include <array>

#include "common/scene/texture_graph/graph_json.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

using Rows = std::array<GraphVector, 3>;

/// Turns about x, then y, then z.
Rows euler_rows(const GraphVector& angles) {
  const auto cos_of = [](const GraphNumber& a) { return cosine(a); };
  const auto sin_of = [](const GraphNumber& a) { return sine(a); };
  const GraphVector c = each(angles, cos_of), s = each(angles, sin_of);
  return {GraphVector{c.y * c.z, s.y * s.x * c.z - c.x * s.z, s.y * c.x * c.z + s.x * s.z},
          GraphVector{c.y * s.z, s.y * s.x * s.z + c.x * c.z, s.y * c.x * s.z - s.x * c.z},
          GraphVector{s.y * -1.0f, c.y * s.x, c.y * c.x}};
}
GraphVector turned_by(const Rows& m, const GraphVector& v) {
  return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}
Rows transposed(const Rows& m) {
  return {GraphVector{m[0].x, m[1].x, m[2].x}, GraphVector{m[0].y, m[1].y, m[2].y},
          GraphVector{m[0].z, m[1].z, m[2].z}};
}
GraphVector quotient(const GraphVector& a, const GraphVector& b) {
  return each(a, b, [](const GraphNumber& x, const GraphNumber& y) { return x / y; });
}
bool is_zero(const GraphVector& v) {
  return v.x.builder->is(v.x, 0) && v.x.builder->is(v.y, 0) && v.x.builder->is(v.z, 0);
}

void read_mapping_node(GraphNode& node) {
  const size_t type = node.choice_index("vector_type", {"POINT", "TEXTURE", "VECTOR", "NORMAL"}, "POINT");
  const GraphVector v = node.vector("Vector", 0, 0, 0), location = node.vector("Location", 0, 0, 0),
                    angles = node.vector("Rotation", 0, 0, 0), scale = node.vector("Scale", 1, 1, 1);
  const bool turns = !is_zero(angles);
  const auto turn = [&](const GraphVector& x, bool back) {
    if (!turns) return x;
    const Rows m = euler_rows(angles);
    return turned_by(back ? transposed(m) : m, x);
  };
  const bool moves = !is_zero(location);
  switch (type) {
    case 0:
      return node.out_vector("Vector", moves ? turn(v * scale, false) + location : turn(v * scale, false));
    case 1:
      return node.out_vector("Vector", quotient(turn(moves ? v - location : v, true), scale));
    case 2:
      return node.out_vector("Vector", turn(v * scale, false));
    default:
      return node.out_vector("Vector", normalized(turn(quotient(v, scale), false)));
  }
}

/// `v` turned about a unit axis (Rodrigues).
GraphVector turned_about(const GraphVector& v, const GraphVector& axis, const GraphNumber& angle) {
  const GraphNumber c = cosine(angle), s = sine(angle);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1.0f - c));
}

void read_vector_rotate(GraphNode& node) {
  const size_t type = node.choice_index(
      "rotation_type", {"AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"}, "AXIS_ANGLE");
  const bool back = node.flag("invert", false);
  GraphBuilder& g = node.builder();
  const GraphVector center = node.vector("Center", 0, 0, 0), given = node.vector("Axis", 0, 0, 1),
                    angles = node.vector("Rotation", 0, 0, 0);
  const GraphVector v = node.vector("Vector", 0, 0, 0), from = v - center;
  GraphNumber angle = node.number("Angle", 0);
  if (back) angle = angle * -1.0f;
  if (type == 4) {
    const Rows m = euler_rows(angles);
    return node.out_vector("Vector", turned_by(back ? transposed(m) : m, from) + center);
  }
  const GraphVector axis = type == 0   ? normalized(given)
                           : type == 1 ? g.constant(1, 0, 0)
                           : type == 2 ? g.constant(0, 1, 0)
                                       : g.constant(0, 0, 1);
  const GraphVector turned = turned_about(from, axis, angle) + center;
  if (type != 0) return node.out_vector("Vector", turned);
  const GraphNumber some = length(given);  // without an axis nothing turns
  node.out_vector("Vector", each(turned, v, [&](const GraphNumber& a, const GraphNumber& b) {
                    return choose(some, a, b);
                  }));
}

GraphVector refracted(const GraphVector& incident, const GraphVector& normal, const GraphNumber& eta) {
  const GraphNumber c = dot(normal, incident), k = 1.0f - eta * eta * (1.0f - c * c);
  const GraphVector out = incident * eta - normal * (eta * c + square_root(k));
  const GraphNumber zero = k.builder->constant(0), negative = k * -1.0f;
  return each(out, [&](const GraphNumber& x) { return choose(negative, zero, x); });
}

GraphVector faced_forward(const GraphVector& v, const GraphVector& incident, const GraphVector& reference) {
  const GraphNumber behind = dot(reference, incident) * -1.0f;
  return each(v, [&](const GraphNumber& x) { return choose(behind, x, x * -1.0f); });
}

void read_vector_math(GraphNode& node) {
  const std::string name = node.choice(
      "operation",
      {"ADD",       "SUBTRACT", "MULTIPLY",    "DIVIDE",      "MULTIPLY_ADD", "CROSS_PRODUCT", "PROJECT",
       "REFLECT",   "REFRACT",  "FACEFORWARD", "DOT_PRODUCT", "DISTANCE",     "LENGTH",        "SCALE",
       "NORMALIZE", "ABSOLUTE", "MINIMUM",     "MAXIMUM",     "FLOOR",        "CEIL",          "FRACTION",
       "MODULO",    "WRAP",     "SNAP",        "SINE",        "COSINE",       "TANGENT"},
      "ADD");
  const GraphVector a = node.vector("Vector", 0, 0, 0), b = node.vector("Vector_001", 0, 0, 0),
                    c = node.vector("Vector_002", 0, 0, 0);
  const GraphNumber scale = node.number("Scale", 1);
  const auto unary = [&](GraphOp op) {
    node.out_vector("Vector", each(a, [&](const GraphNumber& x) { return apply(op, x); }));
  };
  const auto binary = [&](GraphOp op) {
    node.out_vector("Vector",
                    each(a, b, [&](const GraphNumber& x, const GraphNumber& y) { return apply(op, x, y); }));
  };
  if (name == "DOT_PRODUCT") return node.out("Value", dot(a, b));
  if (name == "DISTANCE") return node.out("Value", length(a - b));
  if (name == "LENGTH") return node.out("Value", length(a));
  if (name == "ADD") return node.out_vector("Vector", a + b);
  if (name == "SUBTRACT") return node.out_vector("Vector", a - b);
  if (name == "MULTIPLY") return node.out_vector("Vector", a * b);
  if (name == "DIVIDE") return node.out_vector("Vector", quotient(a, b));
  if (name == "MULTIPLY_ADD") return node.out_vector("Vector", a * b + c);
  if (name == "CROSS_PRODUCT") return node.out_vector("Vector", cross(a, b));
  if (name == "PROJECT") return node.out_vector("Vector", b * (dot(a, b) / dot(b, b)));
  if (name == "REFLECT") {
    const GraphVector n = normalized(b);
    return node.out_vector("Vector", a - n * (dot(a, n) * 2.0f));
  }
  if (name == "REFRACT") return node.out_vector("Vector", refracted(a, normalized(b), scale));
  if (name == "FACEFORWARD") return node.out_vector("Vector", faced_forward(a, b, c));
  if (name == "SCALE") return node.out_vector("Vector", a * scale);
  if (name == "NORMALIZE") return node.out_vector("Vector", normalized(a));
  if (name == "ABSOLUTE") return unary(GraphOp::kAbsolute);
  if (name == "FLOOR") return unary(GraphOp::kFloor);
  if (name == "CEIL") return unary(GraphOp::kCeil);
  if (name == "SINE") return unary(GraphOp::kSine);
  if (name == "COSINE") return unary(GraphOp::kCosine);
  if (name == "TANGENT") return unary(GraphOp::kTangent);
  if (name == "FRACTION") {
    return node.out_vector("Vector", each(a, [](const GraphNumber& x) { return x - floor_of(x); }));
  }
  if (name == "MINIMUM") return binary(GraphOp::kMinimum);
  if (name == "MAXIMUM") return binary(GraphOp::kMaximum);
  if (name == "MODULO") return binary(GraphOp::kModulo);
  if (name == "SNAP") return binary(GraphOp::kSnap);
  node.out_vector("Vector",
                  each(a, b, c, [](const GraphNumber& x, const GraphNumber& y, const GraphNumber& z) {
                    return apply(GraphOp::kWrap, x, y, z);
                  }));
}

void read_normal(GraphNode& node) {
  const nlohmann::json* given = node.member("normal");
  if (!given) node.fail("needs a \"normal\", three numbers");
  const std::vector<double> n = node.numbers(*given, "\"normal\"", 3, 3);
  const GraphVector dir = normalized(
      node.builder().constant(static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])));
  node.out_vector("Normal", dir);
  node.out("Dot", dot(dir, normalized(node.vector("Normal", 0, 0, 1))));
}

}  // namespace

std::vector<GraphNodeType> vector_node_types() {
  return {{"MAPPING", read_mapping_node},
          {"VECTOR_ROTATE", read_vector_rotate},
          {"VECT_MATH", read_vector_math},
          {"NORMAL", read_normal},
          {"VECT_TRANSFORM", nullptr, "write its matrix as VECT_MATH nodes"}};
}

}  // namespace lightmill
