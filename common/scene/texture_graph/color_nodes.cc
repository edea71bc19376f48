// Colours: mixing, ramps, curves, hue and saturation.
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "common/scene/texture_graph/color_ramp.h"
#include "common/scene/texture_graph/graph_json.h"

namespace lightmill {
namespace {

constexpr int kRampSamples = 256;  // as many as Cycles takes

GraphVector hsv_of(const GraphVector& c) {
  return GraphBuilder::triple(c.x.builder->add(GraphOp::kRgbToHsv, {c.x, c.y, c.z}));
}
GraphVector rgb_of(const GraphVector& c) {
  return GraphBuilder::triple(c.x.builder->add(GraphOp::kHsvToRgb, {c.x, c.y, c.z}));
}

const std::vector<std::string_view> kBlends = {
    "MIX",      "DARKEN", "MULTIPLY", "BURN",       "LIGHTEN",      "SCREEN",
    "DODGE",    "ADD",    "OVERLAY",  "SOFT_LIGHT", "LINEAR_LIGHT", "DIFFERENCE",
    "SUBTRACT", "DIVIDE", "HUE",      "SATURATION", "COLOR",        "VALUE"};

/// One channel of the modes that treat channels alike; a is below, b above.
GraphNumber blended_channel(const std::string& mode, const GraphNumber& t, const GraphNumber& a,
                            const GraphNumber& b) {
  GraphBuilder& g = *a.builder;
  const GraphNumber rest = 1.0f - t, zero = g.constant(0), one = g.constant(1);
  if (mode == "DARKEN") return blend(a, minimum(a, b), t);
  if (mode == "MULTIPLY") return blend(a, a * b, t);
  if (mode == "LIGHTEN") return blend(a, maximum(a, b), t);
  if (mode == "SCREEN") return 1.0f - (rest + t * (1.0f - b)) * (1.0f - a);
  if (mode == "ADD") return blend(a, a + b, t);
  if (mode == "SUBTRACT") return blend(a, a - b, t);
  if (mode == "DIFFERENCE") return blend(a, absolute(a - b), t);
  if (mode == "LINEAR_LIGHT") return a + t * (b * 2.0f - 1.0f);
  if (mode == "DIVIDE") return choose(absolute(b), rest * a + t * a / b, a);
  if (mode == "BURN") {
    const GraphNumber under = rest + t * b;
    return choose(under, unit_clamp(1.0f - (1.0f - a) / under), zero);
  }
  if (mode == "DODGE") {
    const GraphNumber under = 1.0f - t * b;
    return choose(absolute(a), choose(under, minimum(a / under, one), one), a);
  }
  if (mode == "OVERLAY") {
    const GraphNumber dark = a * (rest + t * b * 2.0f),
                      light = 1.0f - (rest + t * (1.0f - b) * 2.0f) * (1.0f - a);
    return choose(0.5f - a, dark, light);
  }
  if (mode == "SOFT_LIGHT") {
    const GraphNumber screen = 1.0f - (1.0f - b) * (1.0f - a);
    return rest * a + t * ((1.0f - a) * b * a + a * screen);
  }
  return blend(a, b, t);
}

GraphVector blended(const std::string& mode, const GraphNumber& t, const GraphVector& a,
                    const GraphVector& b) {
  const auto where = [](const GraphNumber& some, const GraphVector& yes, const GraphVector& no) {
    return each(yes, no, [&](const GraphNumber& x, const GraphNumber& y) { return choose(some, x, y); });
  };
  const bool hues = mode == "HUE" || mode == "SATURATION" || mode == "COLOR" || mode == "VALUE";
  if (!hues) {
    return each(a, b,
                [&](const GraphNumber& x, const GraphNumber& y) { return blended_channel(mode, t, x, y); });
  }
  const GraphVector below = hsv_of(a), above = hsv_of(b);
  if (mode == "HUE") return where(above.y, blend(a, rgb_of({above.x, below.y, below.z}), t), a);
  if (mode == "COLOR") return where(above.y, blend(a, rgb_of({above.x, above.y, below.z}), t), a);
  if (mode == "VALUE") return rgb_of({below.x, below.y, blend(below.z, above.z, t)});
  return where(below.y, rgb_of({below.x, blend(below.y, above.y, t), below.z}), a);
}

GraphVector clamped(const GraphVector& c) { return each(c, unit_clamp); }

void read_mix_rgb(GraphNode& node) {
  const std::string mode = node.choice("blend_type", kBlends, "MIX");
  node.flag("use_alpha", false);
  const GraphVector c = blended(mode, unit_clamp(node.number("Fac", 0.5f)), node.color("Color1", 0.5f),
                                node.color("Color2", 0.5f));
  node.out_color("Color", node.flag("use_clamp", false) ? clamped(c) : c);
}

void read_mix(GraphNode& node) {
  const size_t type = node.choice_index("data_type", {"FLOAT", "VECTOR", "RGBA"}, "FLOAT");
  const bool uniform = node.choice("factor_mode", {"UNIFORM", "NON_UNIFORM"}, "UNIFORM") == "UNIFORM";
  const std::string mode = node.choice("blend_type", kBlends, "MIX");
  const bool clamp_factor = node.flag("clamp_factor", true), clamp_result = node.flag("clamp_result", false);
  GraphNumber t = node.number("Factor_Float", 0.5f);
  GraphVector ts = node.color("Factor_Vector", 0.5f);
  if (clamp_factor) t = unit_clamp(t), ts = clamped(ts);
  const GraphNumber a = node.number("A_Float", 0), b = node.number("B_Float", 0);
  const GraphVector va = node.color("A_Vector", 0), vb = node.color("B_Vector", 0);
  const GraphVector ca = node.color("A_Color", 0.5f), cb = node.color("B_Color", 0.5f);
  if (type == 0) return node.out("Result_Float", blend(a, b, t));
  if (type == 1) {
    if (uniform) ts = {t, t, t};
    return node.out_vector("Result_Vector", va + (vb - va) * ts);
  }
  const GraphVector c = blended(mode, t, ca, cb);
  node.out_color("Result_Color", clamp_result ? clamped(c) : c);
}

void read_hue_saturation(GraphNode& node) {
  const GraphVector c = node.color("Color", 0.8f);
  const GraphVector hsv = hsv_of(c);
  GraphNumber hue = hsv.x + node.number("Hue", 0.5f) + 0.5f;
  hue = hue - floor_of(hue);
  const GraphVector out = blend(
      c, rgb_of({hue, unit_clamp(hsv.y * node.number("Saturation", 1)), hsv.z * node.number("Value", 1)}),
      node.number("Fac", 1));
  node.out_color("Color", each(out, [](const GraphNumber& x) { return maximum(x, x.builder->constant(0)); }));
}

void read_bright_contrast(GraphNode& node) {
  const GraphNumber bright = node.number("Bright", 0), contrast = node.number("Contrast", 0);
  const GraphNumber factor = contrast + 1.0f, shift = bright - contrast * 0.5f;
  node.out_color("Color", each(node.color("Color", 1), [&](const GraphNumber& x) {
                   return maximum(x * factor + shift, x.builder->constant(0));
                 }));
}

void read_gamma(GraphNode& node) {
  const GraphNumber gamma = node.number("Gamma", 1);
  node.out_color("Color", each(node.color("Color", 1), [&](const GraphNumber& x) {
                   // Negative values stay, but for a power of 0, which is 1 for all.
                   const GraphNumber y = choose(x, apply(GraphOp::kPower, x, gamma), x);
                   return choose(absolute(gamma), y, x.builder->constant(1));
                 }));
}

void read_invert(GraphNode& node) {
  const GraphVector c = node.color("Color", 0);
  node.out_color("Color",
                 blend(c, each(c, [](const GraphNumber& x) { return 1.0f - x; }), node.number("Fac", 1)));
}

ColorRamp read_ramp_stops(GraphNode& node) {
  ColorRamp ramp;
  ramp.interpolation = static_cast<RampInterpolation>(
      node.choice_index("interpolation", {"LINEAR", "EASE", "CONSTANT", "CARDINAL", "B_SPLINE"}, "LINEAR"));
  ramp.mode = static_cast<RampMode>(node.choice_index("color_mode", {"RGB", "HSV", "HSL"}, "RGB"));
  ramp.hue = static_cast<HueInterpolation>(
      node.choice_index("hue_interpolation", {"NEAR", "FAR", "CW", "CCW"}, "NEAR"));
  const nlohmann::json* elements = node.member("elements");
  if (!elements || !elements->is_array() || elements->empty() || elements->size() > kRampSamples)
    node.fail("needs \"elements\": an array of 1 to " + std::to_string(kRampSamples));
  for (const nlohmann::json& e : *elements) {
    if (!e.is_object() || !e.contains("position") || !e.contains("color") || !e["position"].is_number())
      node.fail("has an element without \"position\" and \"color\"");
    const std::vector<double> c = node.numbers(e["color"], "an element's color", 3, 4);
    ColorRamp::Stop stop{std::clamp(e["position"].get<float>(), 0.0f, 1.0f), {0, 0, 0, 1}};
    for (size_t i = 0; i < c.size(); ++i) stop.color[i] = static_cast<float>(c[i]);
    ramp.stops.push_back(stop);
  }
  std::stable_sort(ramp.stops.begin(), ramp.stops.end(),
                   [](const auto& a, const auto& b) { return a.position < b.position; });
  return ramp;
}

void read_ramp(GraphNode& node) {
  const ColorRamp ramp = read_ramp_stops(node);
  std::array<std::vector<float>, 4> channels;
  for (int i = 0; i < kRampSamples; ++i) {
    const auto c = ramp_color(ramp, static_cast<float>(i) / (kRampSamples - 1));
    for (size_t k = 0; k < 4; ++k) channels[k].push_back(c[k]);
  }
  GraphBuilder& g = node.builder();
  const GraphNumber x = node.number("Fac", 0.5f);
  const GraphOp op = ramp.interpolation == RampInterpolation::kConstant ? GraphOp::kSteps : GraphOp::kTable;
  const auto channel = [&](size_t k) { return g.add(op, {x}, g.table(channels[k]), kRampSamples); };
  node.out_color("Color", {channel(0), channel(1), channel(2)});
  node.out("Alpha", channel(3));
}

/// Curves given as `count` lists of values at even steps between "low" and "high".
std::vector<GraphNumber> curves_of(GraphNode& node, const std::vector<GraphNumber>& at) {
  const nlohmann::json* tables = node.member("tables");
  if (!tables || !tables->is_array() || tables->size() != at.size())
    node.fail("needs \"tables\": " + std::to_string(at.size()) + " arrays of values at even steps");
  const double low = node.parameter("low", 0, -1e6, 1e6), high = node.parameter("high", 1, -1e6, 1e6);
  if (!(high > low)) node.fail("needs a \"high\" above its \"low\"");
  const bool extend = node.choice("extend", {"EXTRAPOLATED", "HORIZONTAL"}, "EXTRAPOLATED") == "EXTRAPOLATED";
  GraphBuilder& g = node.builder();
  std::vector<GraphNumber> out;
  for (size_t k = 0; k < at.size(); ++k) {
    const std::vector<double> values = node.numbers((*tables)[k], "a table", 2, kMostTableValues);
    const int32_t first = g.table({values.begin(), values.end()});
    const GraphNumber x = (at[k] - static_cast<float>(low)) / static_cast<float>(high - low);
    out.push_back(g.add(GraphOp::kTable, {x}, first, static_cast<int32_t>(values.size()), extend));
  }
  return out;
}

void read_float_curve(GraphNode& node) {
  const GraphNumber x = node.number("Value", 1);
  node.out("Value", blend(x, curves_of(node, {x})[0], node.number("Factor", 1)));
}
GraphVector curved(GraphNode& node, const GraphVector& v) {
  const std::vector<GraphNumber> c = curves_of(node, {v.x, v.y, v.z});
  return blend(v, {c[0], c[1], c[2]}, node.number("Fac", 1));
}
void read_rgb_curves(GraphNode& node) { node.out_color("Color", curved(node, node.color("Color", 1))); }
void read_vector_curves(GraphNode& node) {
  node.out_vector("Vector", curved(node, node.vector("Vector", 0, 0, 0)));
}

}  // namespace

std::vector<GraphNodeType> color_node_types() {
  return {{"MIX_RGB", read_mix_rgb},
          {"MIX", read_mix},
          {"HUE_SAT", read_hue_saturation},
          {"BRIGHTCONTRAST", read_bright_contrast},
          {"GAMMA", read_gamma},
          {"INVERT", read_invert},
          {"VALTORGB", read_ramp},
          {"CURVE_FLOAT", read_float_curve},
          {"CURVE_RGB", read_rgb_curves},
          {"CURVE_VEC", read_vector_curves}};
}

}  // namespace lightmill
