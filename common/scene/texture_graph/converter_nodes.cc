// Numbers: maths, ranges, separating and combining.
#include <algorithm>
#include <array>

#include "common/scene/texture_graph/graph_json.h"

namespace lightmill {
namespace {

/// An operation of the Math node that is one of ours; `operands` are those that it reads.
struct MathOperation {
  std::string_view name;
  GraphOp op;
};
constexpr MathOperation kPlainOperations[] = {{"ADD", GraphOp::kAdd},
                                              {"SUBTRACT", GraphOp::kSubtract},
                                              {"MULTIPLY", GraphOp::kMultiply},
                                              {"DIVIDE", GraphOp::kDivide},
                                              {"MULTIPLY_ADD", GraphOp::kMultiplyAdd},
                                              {"POWER", GraphOp::kPower},
                                              {"LOGARITHM", GraphOp::kLogarithm},
                                              {"SQRT", GraphOp::kSqrt},
                                              {"INVERSE_SQRT", GraphOp::kInverseSqrt},
                                              {"ABSOLUTE", GraphOp::kAbsolute},
                                              {"EXPONENT", GraphOp::kExponent},
                                              {"MINIMUM", GraphOp::kMinimum},
                                              {"MAXIMUM", GraphOp::kMaximum},
                                              {"LESS_THAN", GraphOp::kLessThan},
                                              {"GREATER_THAN", GraphOp::kGreaterThan},
                                              {"SIGN", GraphOp::kSign},
                                              {"COMPARE", GraphOp::kCompare},
                                              {"SMOOTH_MIN", GraphOp::kSmoothMinimum},
                                              {"ROUND", GraphOp::kRound},
                                              {"FLOOR", GraphOp::kFloor},
                                              {"CEIL", GraphOp::kCeil},
                                              {"TRUNC", GraphOp::kTruncate},
                                              {"MODULO", GraphOp::kModulo},
                                              {"WRAP", GraphOp::kWrap},
                                              {"SNAP", GraphOp::kSnap},
                                              {"PINGPONG", GraphOp::kPingPong},
                                              {"SINE", GraphOp::kSine},
                                              {"COSINE", GraphOp::kCosine},
                                              {"TANGENT", GraphOp::kTangent},
                                              {"ARCSINE", GraphOp::kArcsine},
                                              {"ARCCOSINE", GraphOp::kArccosine},
                                              {"ARCTANGENT", GraphOp::kArctangent},
                                              {"ARCTAN2", GraphOp::kArctan2},
                                              {"SINH", GraphOp::kHyperbolicSine},
                                              {"COSH", GraphOp::kHyperbolicCosine},
                                              {"TANH", GraphOp::kHyperbolicTangent}};
constexpr std::string_view kOtherOperations[] = {"FRACT", "SMOOTH_MAX", "RADIANS", "DEGREES"};
constexpr float kDegree = 3.14159265358979323846f / 180;

GraphNumber math(const std::string& name, const GraphNumber& a, const GraphNumber& b, const GraphNumber& c) {
  if (name == "FRACT") return a - floor_of(a);
  if (name == "RADIANS") return a * kDegree;
  if (name == "DEGREES") return a * (1 / kDegree);
  if (name == "SMOOTH_MAX") return apply(GraphOp::kSmoothMinimum, a * -1.0f, b * -1.0f, c) * -1.0f;
  const GraphOp op =
      std::find_if(std::begin(kPlainOperations), std::end(kPlainOperations), [&](const auto& o) {
        return o.name == name;
      })->op;
  switch (shape_of(op).operands) {
    case 1:
      return apply(op, a);
    case 2:
      return apply(op, a, b);
    default:
      return apply(op, a, b, c);
  }
}

void read_math(GraphNode& node) {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all(std::begin(kOtherOperations), std::end(kOtherOperations));
    for (const MathOperation& o : kPlainOperations) all.push_back(o.name);
    return all;
  }();
  const std::string name = node.choice("operation", names, "ADD");
  const GraphNumber a = node.number("Value", 0.5f), b = node.number("Value_001", 0.5f),
                    c = node.number("Value_002", 0.5f);
  const GraphNumber x = math(name, a, b, c);
  node.out("Value", node.flag("use_clamp", false) ? unit_clamp(x) : x);
}

enum class RangeShape { kLinear, kStepped, kSmoothStep, kSmootherStep };

GraphNumber mapped(RangeShape shape, const GraphNumber& value, const std::array<GraphNumber, 4>& ends,
                   const GraphNumber& steps) {
  GraphNumber t = (value - ends[0]) / (ends[1] - ends[0]);
  switch (shape) {
    case RangeShape::kLinear:
      break;
    case RangeShape::kStepped:
      t = floor_of(t * (steps + 1.0f)) / maximum(steps, steps.builder->constant(0));
      break;
    case RangeShape::kSmoothStep:
      t = unit_clamp(t);
      t = t * t * (3.0f - t * 2.0f);
      break;
    case RangeShape::kSmootherStep:
      t = unit_clamp(t);
      t = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
      break;
  }
  return ends[2] + t * (ends[3] - ends[2]);
}

GraphNumber between(const GraphNumber& x, const GraphNumber& a, const GraphNumber& b) {
  return minimum(maximum(x, minimum(a, b)), maximum(a, b));
}

void read_map_range(GraphNode& node) {
  const auto shape = static_cast<RangeShape>(
      node.choice_index("interpolation_type", {"LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"}, "LINEAR"));
  const bool vectors = node.choice("data_type", {"FLOAT", "FLOAT_VECTOR"}, "FLOAT") == "FLOAT_VECTOR";
  const bool clamp = node.flag("clamp", true);
  const GraphNumber value = node.number("Value", 1), steps = node.number("Steps", 4);
  const std::array<GraphNumber, 4> ends = {node.number("From Min", 0), node.number("From Max", 1),
                                           node.number("To Min", 0), node.number("To Max", 1)};
  const GraphVector v = node.vector("Vector", 0, 0, 0), v_steps = node.color("Steps_FLOAT3", 4),
                    low = node.color("From_Min_FLOAT3", 0), high = node.color("From_Max_FLOAT3", 1),
                    to_low = node.color("To_Min_FLOAT3", 0), to_high = node.color("To_Max_FLOAT3", 1);
  const auto one = [&](const GraphNumber& x, const std::array<GraphNumber, 4>& e, const GraphNumber& s) {
    const GraphNumber y = mapped(shape, x, e, s);
    return clamp ? between(y, e[2], e[3]) : y;
  };
  if (vectors) {
    node.out_vector("Vector", {one(v.x, {low.x, high.x, to_low.x, to_high.x}, v_steps.x),
                               one(v.y, {low.y, high.y, to_low.y, to_high.y}, v_steps.y),
                               one(v.z, {low.z, high.z, to_low.z, to_high.z}, v_steps.z)});
    return;
  }
  // Nothing is mapped to 0 from an empty range.
  const GraphNumber x = one(value, ends, steps);
  node.out("Result", choose(absolute(ends[1] - ends[0]), x, x.builder->constant(0)));
}

void read_clamp(GraphNode& node) {
  const bool range = node.choice("clamp_type", {"MINMAX", "RANGE"}, "MINMAX") == "RANGE";
  const GraphNumber x = node.number("Value", 1), low = node.number("Min", 0), high = node.number("Max", 1);
  node.out("Result", range ? between(x, low, high) : minimum(maximum(x, low), high));
}

GraphVector converted(GraphOp op, const GraphVector& c) {
  return GraphBuilder::triple(c.x.builder->add(op, {c.x, c.y, c.z}));
}

void read_separate_color(GraphNode& node) {
  const size_t mode = node.choice_index("mode", {"RGB", "HSV", "HSL"}, "RGB");
  GraphVector c = node.color("Color", 0.8f);
  if (mode > 0) c = converted(mode == 1 ? GraphOp::kRgbToHsv : GraphOp::kRgbToHsl, c);
  node.out("Red", c.x), node.out("Green", c.y), node.out("Blue", c.z);
}
void read_combine_color(GraphNode& node) {
  const size_t mode = node.choice_index("mode", {"RGB", "HSV", "HSL"}, "RGB");
  GraphVector c{node.number("Red", 0), node.number("Green", 0), node.number("Blue", 0)};
  if (mode > 0) c = converted(mode == 1 ? GraphOp::kHsvToRgb : GraphOp::kHslToRgb, c);
  node.out_color("Color", c);
}
void read_separate_rgb(GraphNode& node) {
  const GraphVector c = node.color("Image", 0.8f);
  node.out("R", c.x), node.out("G", c.y), node.out("B", c.z);
}
void read_combine_rgb(GraphNode& node) {
  node.out_color("Image", {node.number("R", 0), node.number("G", 0), node.number("B", 0)});
}
void read_separate_hsv(GraphNode& node) {
  const GraphVector c = converted(GraphOp::kRgbToHsv, node.color("Color", 0.8f));
  node.out("H", c.x), node.out("S", c.y), node.out("V", c.z);
}
void read_combine_hsv(GraphNode& node) {
  node.out_color("Color", converted(GraphOp::kHsvToRgb,
                                    {node.number("H", 0), node.number("S", 0), node.number("V", 0)}));
}
void read_separate_xyz(GraphNode& node) {
  const GraphVector v = node.vector("Vector", 0, 0, 0);
  node.out("X", v.x), node.out("Y", v.y), node.out("Z", v.z);
}
void read_combine_xyz(GraphNode& node) {
  node.out_vector("Vector", {node.number("X", 0), node.number("Y", 0), node.number("Z", 0)});
}
void read_grey(GraphNode& node) { node.out("Val", luminance(node.color("Color", 0.5f))); }

}  // namespace

std::vector<GraphNodeType> converter_node_types() {
  return {{"MATH", read_math},
          {"MAP_RANGE", read_map_range},
          {"CLAMP", read_clamp},
          {"SEPARATE_COLOR", read_separate_color},
          {"COMBINE_COLOR", read_combine_color},
          {"SEPRGB", read_separate_rgb},
          {"COMBRGB", read_combine_rgb},
          {"SEPHSV", read_separate_hsv},
          {"COMBHSV", read_combine_hsv},
          {"SEPXYZ", read_separate_xyz},
          {"COMBXYZ", read_combine_xyz},
          {"RGBTOBW", read_grey}};
}

}  // namespace lightmill
