#include "worker/render/scene/textures/graph/graph_program.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/texture_graph/graph_builder.h"
#include "worker/render/scene/textures/graph/graph_operations.h"

namespace lightmill {
namespace {

bool reads_the_surface(GraphOp op) {
  return op == GraphOp::kInput || op == GraphOp::kPoint || op == GraphOp::kImage;
}

float ray_input(GraphInput which, const TexturePoint& at, const Vec3<float>& normal) {
  const RayAtPoint ray = at.ray ? *at.ray : RayAtPoint{normal};
  const auto truth = [](bool x) { return x ? 1.0f : 0.0f; };
  switch (which) {
    case GraphInput::kIncomingX:
      return ray.towards.x;
    case GraphInput::kIncomingY:
      return ray.towards.y;
    case GraphInput::kIncomingZ:
      return ray.towards.z;
    case GraphInput::kBackfacing:
      return truth(dot(at.n, ray.towards) < 0);
    case GraphInput::kIsCameraRay:
      return truth(ray.camera);
    case GraphInput::kIsShadowRay:
      return truth(ray.shadow);
    case GraphInput::kIsDiffuseRay:
      return truth(ray.diffuse);
    case GraphInput::kIsGlossyRay:
      return truth(ray.glossy);
    case GraphInput::kIsSingularRay:
      return truth(ray.singular);
    case GraphInput::kIsReflectionRay:
      return truth(!ray.camera && !ray.shadow && !ray.transmitted);
    case GraphInput::kIsTransmissionRay:
      return truth(ray.transmitted);
    case GraphInput::kRayLength:
      return ray.length;
    default:
      return static_cast<float>(ray.depth);
  }
}

float surface_input(GraphInput which, const TexturePoint& at) {
  const bool shaded = at.ns.x != 0 || at.ns.y != 0 || at.ns.z != 0;
  const Vec3<float>& n = shaded ? at.ns : at.n;
  switch (which) {
    case GraphInput::kU:
      return at.u;
    case GraphInput::kV:
      return at.v;
    case GraphInput::kSecondU:
      return at.second_u;
    case GraphInput::kSecondV:
      return at.second_v;
    case GraphInput::kRed:
    case GraphInput::kGreen:
    case GraphInput::kBlue:
    case GraphInput::kAlpha:
      return at.color[static_cast<size_t>(which) - static_cast<size_t>(GraphInput::kRed)];
    case GraphInput::kTrueNormalX:
      return at.n.x;
    case GraphInput::kTrueNormalY:
      return at.n.y;
    case GraphInput::kTrueNormalZ:
      return at.n.z;
    case GraphInput::kNormalX:
      return n.x;
    case GraphInput::kNormalY:
      return n.y;
    case GraphInput::kNormalZ:
      return n.z;
    default:
      return ray_input(which, at, n);
  }
}

/// The point in a space, rounded once.
std::array<float, 3> point_in(const Transform& t, const Vec3d& p) {
  std::array<float, 3> out{};
  for (size_t i = 0; i < 3; ++i)
    out[i] = static_cast<float>(t.m[i][0] * p.x + t.m[i][1] * p.y + t.m[i][2] * p.z + t.m[i][3]);
  return out;
}

}  // namespace

GraphProgram::GraphProgram(const TextureGraph& graph, std::vector<int> images)
    : graph_(graph), images_(std::move(images)) {
  fold();
  drop_unused(&graph_);
  assign_registers();
}

void GraphProgram::fold() {
  std::vector<int32_t> folded(static_cast<size_t>(graph_.results));  // the constant that a result is; else 0
  const auto resolve = [&](int32_t* operand) {
    if (*operand >= 0 && folded[static_cast<size_t>(*operand)] < 0)
      *operand = folded[static_cast<size_t>(*operand)];
  };
  for (const GraphOperation& o : graph_.operations) {
    const GraphOpShape shape = shape_of(o.op);
    float a[kMostOperands] = {}, r[kMostResults] = {};
    bool known = !reads_the_surface(o.op);
    for (int32_t k = 0; k < shape.operands; ++k) {
      int32_t& operand = graph_.operands[static_cast<size_t>(o.first_operand + k)];
      resolve(&operand);
      known = known && operand < 0;
      if (operand < 0) a[k] = graph_.constants[static_cast<size_t>(~operand)];
    }
    if (!known) continue;
    graph::apply_operation<float>(o, graph_.tables.data(), a, r);
    for (int32_t k = 0; k < shape.results; ++k) {
      folded[static_cast<size_t>(o.first_result + k)] = ~static_cast<int32_t>(graph_.constants.size());
      graph_.constants.push_back(r[k]);
    }
  }
  for (int32_t& operand : graph_.output) resolve(&operand);
}

void GraphProgram::assign_registers() {
  const auto results = static_cast<size_t>(graph_.results);
  std::vector<size_t> last_use(results);
  for (size_t i = 0; i < graph_.operations.size(); ++i) {
    const GraphOperation& o = graph_.operations[i];
    for (int32_t k = 0; k < shape_of(o.op).operands; ++k) {
      const int32_t operand = graph_.operands[static_cast<size_t>(o.first_operand + k)];
      if (operand >= 0) last_use[static_cast<size_t>(operand)] = i;
    }
  }
  for (const int32_t operand : graph_.output) {
    if (operand >= 0) last_use[static_cast<size_t>(operand)] = graph_.operations.size();
  }
  std::vector<int32_t> of(results, -1), free_ones;
  for (int32_t i = kRegisters; i-- > 0;) free_ones.push_back(i);
  for (size_t i = 0; i < graph_.operations.size(); ++i) {
    GraphOperation& o = graph_.operations[i];
    const GraphOpShape shape = shape_of(o.op);
    // What is read for the last time here makes room, once.
    for (int32_t k = 0; k < shape.operands; ++k) {
      int32_t& operand = graph_.operands[static_cast<size_t>(o.first_operand + k)];
      if (operand < 0) continue;
      const auto result = static_cast<size_t>(operand);
      operand = of[result];
      if (last_use[result] != i) continue;
      last_use[result] = graph_.operations.size() + 1;
      free_ones.push_back(of[result]);
    }
    const auto first = static_cast<size_t>(o.first_result);
    o.first_result = static_cast<int32_t>(registers_.size());
    if (free_ones.size() < shape.results)
      fail_scene("a texture graph needs more than " + std::to_string(kRegisters) + " values at once");
    for (size_t k = 0; k < shape.results; ++k) {
      of[first + k] = free_ones.back();
      free_ones.pop_back();
      registers_.push_back(of[first + k]);
    }
    for (size_t k = 0; k < shape.results; ++k) {
      if (last_use[first + k] == 0) free_ones.push_back(of[first + k]);  // nobody reads it
    }
  }
  for (int32_t& operand : graph_.output) operand = operand < 0 ? operand : of[static_cast<size_t>(operand)];
}

template <class F>
void GraphProgram::evaluate(const TextureTable& textures, const TexturePoint* at, F out[3]) const {
  F registers[kRegisters];
  const auto value = [&](int32_t operand) {
    return operand < 0 ? splat<F>(graph_.constants[static_cast<size_t>(~operand)]) : registers[operand];
  };
  for (const GraphOperation& o : graph_.operations) {
    const GraphOpShape shape = shape_of(o.op);
    F a[kMostOperands], r[kMostResults];
    const int32_t* const operands = graph_.operands.data() + o.first_operand;
    for (int k = 0; k < shape.operands; ++k) a[k] = value(operands[k]);
    if (reads_the_surface(o.op)) {
      for (int l = 0; l < kWidth<F>; ++l) {
        if (o.op == GraphOp::kInput) {
          set_lane(&r[0], l, surface_input(static_cast<GraphInput>(o.p), at[l]));
          continue;
        }
        std::array<float, 3> v{};
        if (o.op == GraphOp::kPoint) {
          v = point_in(graph_.spaces[static_cast<size_t>(o.p)], at[l].p);
        } else {
          // Where images may be missing, a constant is in the place of one.
          const int id = images_[static_cast<size_t>(o.p)];
          const ImageMap* const image = textures.image(id);
          const Rgb c =
              image ? image->lookup(lane(a[0], l), lane(a[1], l)) : textures.evaluate(id, TexturePoint{});
          v = {c.r, c.g, c.b};
        }
        for (size_t k = 0; k < 3; ++k) set_lane(&r[k], l, v[k]);
      }
    } else {
      graph::apply_operation<F>(o, graph_.tables.data(), a, r);
    }
    const int32_t* const results = registers_.data() + o.first_result;
    for (int k = 0; k < shape.results; ++k) registers[results[k]] = r[k];
  }
  for (size_t k = 0; k < 3; ++k) {
    const F x = value(graph_.output[k]);
    out[k] = select(MaskOf<F>(abs(x) < 1e30f), x, F{});
  }
}
template void GraphProgram::evaluate(const TextureTable&, const TexturePoint*, float[3]) const;
template void GraphProgram::evaluate(const TextureTable&, const TexturePoint*, Float8[3]) const;

std::optional<Rgb> GraphProgram::constant() const {
  float c[3];
  for (size_t k = 0; k < 3; ++k) {
    if (graph_.output[k] >= 0) return std::nullopt;
    c[k] = graph_.constants[static_cast<size_t>(~graph_.output[k])];
    if (!(std::fabs(c[k]) < 1e30f)) c[k] = 0;
  }
  return Rgb{c[0], c[1], c[2]};
}

}  // namespace lightmill
