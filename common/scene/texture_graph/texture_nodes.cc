// Texture nodes: patterns and noise. Semantics are Blender 3.4's; the hash and the offsets that tell one
// noise from another are Cycles'.
#include <array>
#include <cmath>

#include "common/scene/texture_graph/graph_json.h"
#include "common/scene/texture_graph/noise_offsets.h"

namespace lightmill {
namespace {

using Point4 = std::array<GraphNumber, 4>;
constexpr float kTurn = 2 * 3.14159265358979323846f;
const std::vector<std::string_view> kDimensions = {"1D", "2D", "3D", "4D"};

int dimensions_of(GraphNode& node, const char* name) {
  return static_cast<int>(node.choice_index(name, kDimensions, "3D")) + 1;
}

/// The point at which a noise is looked up, times `scale`.
Point4 scaled_point(GraphNode& node, const GraphNumber& scale) {
  const GraphVector v = texture_vector(node) * scale;
  return {v.x, v.y, v.z, node.number("W", 0) * scale};
}

/// `p` shifted by the offset of number `seed`, so that another noise is found there.
Point4 shifted(Point4 p, int dimensions, int seed) {
  for (int axis = 0; axis < dimensions; ++axis) {
    GraphNumber& x = p[static_cast<size_t>(dimensions == 1 ? 3 : axis)];
    x = x + noise_offset(dimensions, seed, axis);
  }
  return p;
}

GraphNumber perlin(const Point4& p, int dimensions) {
  return p[0].builder->add(GraphOp::kPerlin, {p[0], p[1], p[2], p[3]}, dimensions);
}
GraphNumber fractal(const Point4& p, int dimensions, const GraphNumber& detail,
                    const GraphNumber& roughness) {
  return p[0].builder->add(GraphOp::kFractal, {p[0], p[1], p[2], p[3], detail, roughness}, dimensions);
}

void read_noise_node(GraphNode& node) {
  const int dimensions = dimensions_of(node, "noise_dimensions");
  const Point4 at = scaled_point(node, node.number("Scale", 5));
  const GraphNumber detail = node.number("Detail", 2), roughness = node.number("Roughness", 0.5f),
                    distortion = node.number("Distortion", 0);
  Point4 p = at;
  if (!node.builder().is(distortion, 0)) {
    for (int axis = 0; axis < dimensions; ++axis) {
      GraphNumber& x = p[static_cast<size_t>(dimensions == 1 ? 3 : axis)];
      x = x + perlin(shifted(at, dimensions, axis), dimensions) * distortion;
    }
  }
  const auto noise = [&](const Point4& q) { return fractal(q, dimensions, detail, roughness); };
  const GraphNumber value = noise(p);
  node.out("Fac", value);
  node.out_color("Color", {value, noise(shifted(p, dimensions, dimensions)),
                           noise(shifted(p, dimensions, dimensions + 1))});
}

void read_musgrave(GraphNode& node) {
  const int dimensions = dimensions_of(node, "musgrave_dimensions");
  const auto kind = static_cast<int32_t>(node.choice_index(
      "musgrave_type",
      {"MULTIFRACTAL", "FBM", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HETERO_TERRAIN"}, "FBM"));
  const Point4 p = scaled_point(node, node.number("Scale", 5));
  node.out("Fac", node.builder().add(
                      GraphOp::kMusgrave,
                      {p[0], p[1], p[2], p[3], node.number("Detail", 2), node.number("Dimension", 2),
                       node.number("Lacunarity", 2), node.number("Offset", 0), node.number("Gain", 1)},
                      dimensions, kind));
}

void read_voronoi(GraphNode& node) {
  const int dimensions = dimensions_of(node, "voronoi_dimensions");
  const auto metric = static_cast<int32_t>(
      node.choice_index("distance", {"EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI"}, "EUCLIDEAN"));
  const auto feature = static_cast<int32_t>(
      node.choice_index("feature", {"F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"}, "F1"));
  const GraphNumber scale = node.number("Scale", 5);
  const Point4 p = scaled_point(node, scale);
  const GraphNumber smoothness = node.number("Smoothness", 1), exponent = node.number("Exponent", 0.5f);
  const GraphNumber first = node.builder().add(
      GraphOp::kVoronoi, {p[0], p[1], p[2], p[3], smoothness, exponent, node.number("Randomness", 1)},
      dimensions, feature, metric);
  const auto result = [&](int k) { return GraphBuilder::at(first, k); };
  if (feature == static_cast<int>(VoronoiFeature::kNSphereRadius)) return node.out("Radius", first);
  node.out("Distance", first);
  if (feature == static_cast<int>(VoronoiFeature::kDistanceToEdge)) return;
  node.out_color("Color", {result(1), result(2), result(3)});
  node.out_vector("Position", {result(4) / scale, result(5) / scale, result(6) / scale});
  node.out("W", result(7) / scale);
}

void read_white_noise(GraphNode& node) {
  const int dimensions = dimensions_of(node, "noise_dimensions");
  const GraphVector v = texture_vector(node);
  const GraphNumber first =
      node.builder().add(GraphOp::kWhiteNoise, {v.x, v.y, v.z, node.number("W", 0)}, dimensions);
  node.out("Value", first);
  node.out_color("Color", GraphBuilder::triple(GraphBuilder::at(first, 1)));
}

/// Moved off the borders of cells, where rounding would choose; as Cycles does.
GraphVector off_borders(const GraphVector& p) {
  return each(p, [](const GraphNumber& x) { return (x + 1e-6f) * 0.999999f; });
}

void read_wave(GraphNode& node) {
  const bool rings = node.choice("wave_type", {"BANDS", "RINGS"}, "BANDS") == "RINGS";
  const size_t band = node.choice_index("bands_direction", {"X", "Y", "Z", "DIAGONAL"}, "X"),
               ring = node.choice_index("rings_direction", {"X", "Y", "Z", "SPHERICAL"}, "X");
  const size_t profile = node.choice_index("wave_profile", {"SIN", "SAW", "TRI"}, "SIN");
  const GraphVector p = off_borders(texture_vector(node) * node.number("Scale", 5));
  GraphNumber n;
  if (rings) {
    GraphVector r = p;
    const GraphNumber zero = node.builder().constant(0);
    if (ring == 0) r.x = zero;
    if (ring == 1) r.y = zero;
    if (ring == 2) r.z = zero;
    n = length(r) * 20.0f;
  } else {
    n = band == 0   ? p.x * 20.0f
        : band == 1 ? p.y * 20.0f
        : band == 2 ? p.z * 20.0f
                    : (p.x + p.y + p.z) * 10.0f;
  }
  n = n + node.number("Phase Offset", 0);
  const GraphNumber distortion = node.number("Distortion", 0), detail = node.number("Detail", 2),
                    roughness = node.number("Detail Roughness", 0.5f), scale = node.number("Detail Scale", 1);
  if (!node.builder().is(distortion, 0)) {
    const GraphVector q = p * scale;
    n = n + distortion * (fractal({q.x, q.y, q.z, q.z}, 3, detail, roughness) * 2.0f - 1.0f);
  }
  const GraphNumber turns = n / kTurn;
  const GraphNumber value = profile == 0   ? sine(n - kTurn / 4) * 0.5f + 0.5f
                            : profile == 1 ? turns - floor_of(turns)
                                           : absolute(turns - floor_of(turns + 0.5f)) * 2.0f;
  node.out("Fac", value);
  node.out_color("Color", {value, value, value});
}

void read_gradient(GraphNode& node) {
  const std::string type = node.choice(
      "gradient_type",
      {"LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"}, "LINEAR");
  const GraphVector p = texture_vector(node);
  GraphNumber value = p.x;
  if (type == "QUADRATIC") {
    const GraphNumber r = maximum(p.x, p.x.builder->constant(0));
    value = r * r;
  } else if (type == "EASING") {
    const GraphNumber r = unit_clamp(p.x), t = r * r;
    value = t * 3.0f - t * r * 2.0f;
  } else if (type == "DIAGONAL") {
    value = (p.x + p.y) * 0.5f;
  } else if (type == "RADIAL") {
    value = apply(GraphOp::kArctan2, p.y, p.x) / kTurn + 0.5f;
  } else if (type != "LINEAR") {
    const GraphNumber r = maximum(0.999999f - length(p), p.x.builder->constant(0));
    value = type == "SPHERICAL" ? r : r * r;
  }
  value = unit_clamp(value);
  node.out("Fac", value);
  node.out_color("Color", {value, value, value});
}

void read_magic(GraphNode& node) {
  const int depth = static_cast<int>(node.parameter("turbulence_depth", 2, 0, 10));
  const GraphNumber turn = node.builder().constant(kTurn);
  const GraphVector p =
      each(texture_vector(node), [&](const GraphNumber& x) { return apply(GraphOp::kModulo, x, turn); });
  const GraphNumber scale = node.number("Scale", 5) * 5.0f;
  GraphNumber d = node.number("Distortion", 1);
  GraphNumber x = sine((p.x + p.y + p.z) * scale), y = cosine((p.y - p.x - p.z) * scale),
              z = cosine((p.z - p.x - p.y) * scale) * -1.0f;
  if (depth > 0) {
    x = x * d, y = y * d, z = z * d;
    y = cosine(x - y + z) * -1.0f * d;
  }
  if (depth > 1) x = cosine(x - y - z) * d;
  if (depth > 2) z = sine((x + y + z) * -1.0f) * d;
  if (depth > 3) x = cosine(y - x - z) * -1.0f * d;
  if (depth > 4) y = sine(y - x + z) * -1.0f * d;
  if (depth > 5) y = cosine(y - x + z) * -1.0f * d;
  if (depth > 6) x = cosine(x + y + z) * d;
  if (depth > 7) z = sine(x + y - z) * d;
  if (depth > 8) x = cosine((x + y - z) * -1.0f) * -1.0f * d;
  if (depth > 9) y = sine(x - y + z) * -1.0f * d;
  // Without distortion the sums stay as they are.
  d = choose(absolute(d), d * 2.0f, d.builder->constant(1));
  const GraphVector c{0.5f - x / d, 0.5f - y / d, 0.5f - z / d};
  node.out_color("Color", c);
  node.out("Fac", (c.x + c.y + c.z) * (1.0f / 3.0f));
}

void read_checker(GraphNode& node) {
  const GraphVector a = node.color("Color1", 0.8f), b = node.color("Color2", 0.2f);
  const GraphVector p = off_borders(texture_vector(node) * node.number("Scale", 5));
  const GraphNumber cell = floor_of(p.x) + floor_of(p.y) + floor_of(p.z);
  const GraphNumber odd = absolute(apply(GraphOp::kModulo, cell, p.x.builder->constant(2)));
  node.out_color("Color",
                 each(a, b, [&](const GraphNumber& x, const GraphNumber& y) { return choose(odd, x, y); }));
  node.out("Fac", odd);
}

void read_brick(GraphNode& node) {
  const GraphVector p = texture_vector(node) * node.number("Scale", 5);
  const GraphVector a = node.color("Color1", 0.8f), b = node.color("Color2", 0.2f),
                    mortar = node.color("Mortar", 0);
  const auto frequency = [&](const char* name) {
    return static_cast<int32_t>(node.parameter(name, 2, 0, 99));
  };
  const auto fraction = [&](const char* name, double fallback, double high) {
    return node.builder().constant(static_cast<float>(node.parameter(name, fallback, 0, high)));
  };
  const GraphNumber first = node.builder().add(
      GraphOp::kBrick,
      {p.x, p.y, node.number("Mortar Size", 0.02f), node.number("Mortar Smooth", 0.1f),
       node.number("Bias", 0), node.number("Brick Width", 0.5f), node.number("Row Height", 0.25f),
       fraction("offset", 0.5, 1), fraction("squash", 1, 99)},
      frequency("offset_frequency"), frequency("squash_frequency"));
  const GraphNumber between = GraphBuilder::at(first, 1);
  node.out_color("Color", blend(blend(a, b, first), mortar, between));
  node.out("Fac", between);
}

}  // namespace

std::vector<GraphNodeType> texture_node_types() {
  return {{"TEX_NOISE", read_noise_node},
          {"TEX_MUSGRAVE", read_musgrave},
          {"TEX_VORONOI", read_voronoi},
          {"TEX_WHITE_NOISE", read_white_noise},
          {"TEX_WAVE", read_wave},
          {"TEX_GRADIENT", read_gradient},
          {"TEX_MAGIC", read_magic},
          {"TEX_CHECKER", read_checker},
          {"TEX_BRICK", read_brick},
          {"TEX_IMAGE", read_image_node},
          {"TEX_ENVIRONMENT", read_environment_node},
          {"TEX_SKY", nullptr, "write the world as an image"},
          {"TEX_IES", nullptr, "a light's pattern belongs to the light"},
          {"TEX_POINTDENSITY", nullptr, "points are not known here"}};
}

}  // namespace lightmill
