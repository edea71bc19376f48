#include "worker/render/scene/textures/graph/every_operation.h"

#include "worker/render/scene/textures/graph/graph_operations.h"

namespace lightmill {

std::vector<float> every_graph_operation() {
  constexpr int kKinds = 5;
  const float table[] = {0.1f, 0.9f, 0.3f, 0.7f};
  std::vector<float> out;
  Float8 a[kMostOperands], r[kMostResults];
  for (int k = 0; k < kMostOperands; ++k) {
    for (int l = 0; l < 8; ++l)
      a[k][l] = static_cast<float>((k * 29 + l * 17) % 23) * 0.37f - (k == 2 ? 3.1f : 0.4f);
  }
  for (int op = static_cast<int>(GraphOp::kAdd); op < static_cast<int>(GraphOp::kCount); ++op) {
    const auto kind = static_cast<GraphOp>(op);
    const bool tabled = kind == GraphOp::kTable || kind == GraphOp::kSteps;
    const bool many = shape_of(kind).operands > 3 && kind != GraphOp::kBrick;
    for (int i = 0; i < (many ? 4 * kKinds : 1); ++i) {
      GraphOperation o{kind, 0, 0, i % 4 + 1, i / 4, i % 4};
      if (tabled) o.p = 0, o.q = 4, o.r = 1;
      if (kind == GraphOp::kBrick) o.q = 2;
      graph::apply_operation<Float8>(o, table, a, r);
      for (int k = 0; k < shape_of(kind).results; ++k) {
        for (int l = 0; l < 8; ++l) out.push_back(r[k][l]);
      }
    }
  }
  return out;
}

}  // namespace lightmill
