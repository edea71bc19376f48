#pragma once
// Texture graphs: flat lists of operations on floats, evaluated where a surface is hit.
//
// An operation reads operands and makes results, which are numbered in order over the whole list. An operand
// is a result of an earlier operation (its number), or constant ~operand. Colours and vectors are three
// floats. docs/texture-graph.md describes the file that a graph is read from.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene_values.h"

namespace lightmill {

/// Names as in Blender's Math node where it has them. `a`, `b`, `c` are the operands; p, q, r the parameters.
enum class GraphOp : uint8_t {
  kInput,  // what the surface says: GraphInput p
  kPoint,  // the position in space p of the graph
  kImage,  // texel colour of image p of the graph at (a, b)
  // Arithmetic.
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,  // 0 where b is 0
  kMultiplyAdd,
  kPower,
  kLogarithm,
  kSqrt,
  kInverseSqrt,
  kAbsolute,
  kExponent,
  kMinimum,
  kMaximum,
  kLessThan,
  kGreaterThan,
  kSign,
  kCompare,  // whether a and b differ by c at most
  kSmoothMinimum,
  kRound,
  kFloor,
  kCeil,
  kTruncate,
  kModulo,  // of the sign of a; 0 where b is 0
  kWrap,
  kSnap,
  kPingPong,
  kSine,
  kCosine,
  kTangent,
  kArcsine,
  kArccosine,
  kArctangent,
  kArctan2,
  kHyperbolicSine,
  kHyperbolicCosine,
  kHyperbolicTangent,
  kChoose,  // b where a > 0, else c
  // Colours.
  kRgbToHsv,
  kHsvToRgb,
  kRgbToHsl,
  kHslToRgb,
  kTable,  // at a, linear between `q` values from tables[p] on, which stand at even steps over [0, 1]; the
           // last difference goes on beyond the ends if r is 1
  kSteps,  // the same without the blend
  // Noise; p is the number of dimensions, 1 to 4: the operands x, y, z, w, of which one dimension has w
  // alone.
  kPerlin,      // in [-1, 1]
  kFractal,     // of (x, y, z, w, detail, roughness), in [0, 1]
  kMusgrave,    // of (x, y, z, w, detail, dimension, lacunarity, offset, gain); q: MusgraveKind
  kVoronoi,     // of (x, y, z, w, smoothness, exponent, randomness); q: VoronoiFeature, r: VoronoiMetric
  kWhiteNoise,  // value and three more
  kBrick,  // of (x, y, mortar, smooth, bias, width, height, offset, squash); p, q: the two frequencies. Tint
           // and mortar
  kCount
};

struct GraphOpShape {
  uint8_t operands, results;
};
inline constexpr int kMostOperands = 9, kMostResults = 8;
constexpr GraphOpShape shape_of(GraphOp op) {
  switch (op) {
    case GraphOp::kInput:
      return {0, 1};
    case GraphOp::kPoint:
      return {0, 3};
    case GraphOp::kImage:
      return {2, 3};
    case GraphOp::kAdd:
    case GraphOp::kSubtract:
    case GraphOp::kMultiply:
    case GraphOp::kDivide:
    case GraphOp::kPower:
    case GraphOp::kLogarithm:
    case GraphOp::kMinimum:
    case GraphOp::kMaximum:
    case GraphOp::kLessThan:
    case GraphOp::kGreaterThan:
    case GraphOp::kModulo:
    case GraphOp::kSnap:
    case GraphOp::kPingPong:
    case GraphOp::kArctan2:
      return {2, 1};
    case GraphOp::kMultiplyAdd:
    case GraphOp::kCompare:
    case GraphOp::kSmoothMinimum:
    case GraphOp::kWrap:
    case GraphOp::kChoose:
      return {3, 1};
    case GraphOp::kRgbToHsv:
    case GraphOp::kHsvToRgb:
    case GraphOp::kRgbToHsl:
    case GraphOp::kHslToRgb:
      return {3, 3};
    case GraphOp::kPerlin:
      return {4, 1};
    case GraphOp::kFractal:
      return {6, 1};
    case GraphOp::kMusgrave:
      return {9, 1};
    case GraphOp::kVoronoi:
      return {7, 8};  // distance, colour, position, w
    case GraphOp::kWhiteNoise:
      return {4, 4};
    case GraphOp::kBrick:
      return {9, 2};
    default:
      return {1, 1};
  }
}

/// The texture coordinates of the mesh's two sets, its vertex colours, and its unit normals in the scene's
/// space: the geometric one of the surface's outside and the one that is shaded.
enum class GraphInput {
  kU,
  kV,
  kSecondU,
  kSecondV,
  kRed,
  kGreen,
  kBlue,
  kAlpha,
  kTrueNormalX,
  kTrueNormalY,
  kTrueNormalZ,
  kNormalX,
  kNormalY,
  kNormalZ,
  // Of the ray that meets the surface: the unit direction to where it comes from, in the scene's space;
  // whether it meets the surface from inside; what it is (0 or 1), its length in scene units, and how often
  // its path was scattered before. Camera paths alone know them.
  kIncomingX,
  kIncomingY,
  kIncomingZ,
  kBackfacing,
  kIsCameraRay,
  kIsShadowRay,
  kIsDiffuseRay,
  kIsGlossyRay,
  kIsSingularRay,
  kIsReflectionRay,
  kIsTransmissionRay,
  kRayLength,
  kRayDepth,
};
constexpr bool is_of_ray(GraphInput which) { return which >= GraphInput::kIncomingX; }
enum class MusgraveKind { kMultifractal, kFbm, kHybridMultifractal, kRidgedMultifractal, kHeteroTerrain };
enum class VoronoiFeature { kF1, kF2, kSmoothF1, kDistanceToEdge, kNSphereRadius };
enum class VoronoiMetric { kEuclidean, kManhattan, kChebychev, kMinkowski };

struct GraphOperation {
  GraphOp op = GraphOp::kAdd;
  int32_t first_operand = 0;  // into TextureGraph::operands
  int32_t first_result = 0;
  int32_t p = 0, q = 0, r = 0;
};

/// An image that a graph shows.
struct GraphImage {
  std::string file;  // as the graph names it
  std::string extension = "REPEAT", color_space = "sRGB";
  TexelFilter filter = TexelFilter::kBilinear;
  bool alpha = false;
};

struct TextureGraph {
  std::vector<GraphOperation> operations;
  std::vector<int32_t> operands;
  std::vector<float> constants, tables;
  std::vector<Transform> spaces;              // from the scene's space
  std::array<int32_t, 3> output{-1, -1, -1};  // operands
  int32_t results = 0;                        // of all operations
  Transform to_world;                         // the space "world", from the scene's
};

/// Whether what it shows depends on the ray that meets the surface.
bool reads_ray(const TextureGraph& graph);
/// Whether it asks for the colours of vertices, or for the second texture coordinates.
bool reads_colors(const TextureGraph& graph);
bool reads_second_uvs(const TextureGraph& graph);

}  // namespace lightmill
