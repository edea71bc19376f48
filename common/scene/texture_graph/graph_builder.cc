#include "common/scene/texture_graph/graph_builder.h"

#include <algorithm>
#include <bit>

namespace lightmill {
namespace {

/// f(a, b) at once if both are constants, else an operation.
template <class Function>
GraphNumber arithmetic(GraphOp op, const GraphNumber& a, const GraphNumber& b, const Function& f) {
  GraphBuilder& g = *a.builder;
  const float *x = g.known(a), *y = g.known(b);
  return x && y ? g.constant(f(*x, *y)) : g.add(op, {a, b});
}

}  // namespace

GraphNumber GraphBuilder::constant(float x) {
  const auto [found, is_new] =
      constants_.try_emplace(std::bit_cast<uint32_t>(x), static_cast<int32_t>(graph_.constants.size()));
  if (is_new) graph_.constants.push_back(x);
  return {this, ~found->second};
}

const float* GraphBuilder::known(const GraphNumber& x) const {
  return x.operand < 0 ? &graph_.constants[static_cast<size_t>(~x.operand)] : nullptr;
}

GraphNumber GraphBuilder::add(GraphOp op, std::initializer_list<GraphNumber> operands, int32_t p, int32_t q,
                              int32_t r) {
  const GraphOperation o{op, static_cast<int32_t>(graph_.operands.size()), graph_.results, p, q, r};
  for (const GraphNumber& operand : operands) graph_.operands.push_back(operand.operand);
  graph_.operations.push_back(o);
  graph_.results += shape_of(op).results;
  return {this, o.first_result};
}

int32_t GraphBuilder::space(const Transform& t) {
  const auto same = [&](const Transform& other) { return other.m == t.m; };
  const auto found = std::find_if(graph_.spaces.begin(), graph_.spaces.end(), same);
  const auto i = static_cast<int32_t>(found - graph_.spaces.begin());
  if (found == graph_.spaces.end()) graph_.spaces.push_back(t);
  return i;
}

int32_t GraphBuilder::table(const std::vector<float>& values) {
  const auto first = static_cast<int32_t>(graph_.tables.size());
  graph_.tables.insert(graph_.tables.end(), values.begin(), values.end());
  return first;
}

namespace {

template <class Wanted>
bool reads_input(const TextureGraph& graph, Wanted wanted) {
  return std::ranges::any_of(graph.operations, [&](const GraphOperation& o) {
    return o.op == GraphOp::kInput && wanted(static_cast<GraphInput>(o.p));
  });
}

}  // namespace

bool reads_ray(const TextureGraph& graph) { return reads_input(graph, is_of_ray); }
bool reads_colors(const TextureGraph& graph) {
  return reads_input(graph, [](GraphInput i) { return i >= GraphInput::kRed && i <= GraphInput::kAlpha; });
}
bool reads_second_uvs(const TextureGraph& graph) {
  return reads_input(graph,
                     [](GraphInput i) { return i == GraphInput::kSecondU || i == GraphInput::kSecondV; });
}

TextureGraph GraphBuilder::finish(const GraphVector& output) {
  graph_.output = {output.x.operand, output.y.operand, output.z.operand};
  drop_unused(&graph_);
  return std::move(graph_);
}

void drop_unused(TextureGraph* graph) {
  std::vector<bool> needed(static_cast<size_t>(graph->results));
  const auto need = [&](int32_t operand) {
    if (operand >= 0) needed[static_cast<size_t>(operand)] = true;
  };
  std::for_each(graph->output.begin(), graph->output.end(), need);
  std::vector<bool> kept(graph->operations.size());
  for (size_t i = kept.size(); i-- > 0;) {
    const GraphOperation& o = graph->operations[i];
    const GraphOpShape shape = shape_of(o.op);
    for (int32_t k = 0; k < shape.results; ++k)
      kept[i] = kept[i] || needed[static_cast<size_t>(o.first_result + k)];
    for (int32_t k = 0; kept[i] && k < shape.operands; ++k)
      need(graph->operands[static_cast<size_t>(o.first_operand + k)]);
  }
  // What is left is numbered anew.
  TextureGraph out;
  out.constants = std::move(graph->constants), out.tables = std::move(graph->tables),
  out.spaces = std::move(graph->spaces), out.to_world = graph->to_world;
  std::vector<int32_t> number(needed.size(), -1);
  const auto renumbered = [&](int32_t operand) {
    return operand < 0 ? operand : number[static_cast<size_t>(operand)];
  };
  for (size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    GraphOperation o = graph->operations[i];
    const GraphOpShape shape = shape_of(o.op);
    const int32_t from = o.first_operand, result = o.first_result;
    o.first_operand = static_cast<int32_t>(out.operands.size()), o.first_result = out.results;
    for (int32_t k = 0; k < shape.operands; ++k)
      out.operands.push_back(renumbered(graph->operands[static_cast<size_t>(from + k)]));
    for (int32_t k = 0; k < shape.results; ++k) number[static_cast<size_t>(result + k)] = out.results++;
    out.operations.push_back(o);
  }
  for (size_t k = 0; k < 3; ++k) out.output[k] = renumbered(graph->output[k]);
  *graph = std::move(out);
}

// Evaluation rounds these likewise.
GraphNumber operator+(const GraphNumber& a, const GraphNumber& b) {
  return arithmetic(GraphOp::kAdd, a, b, [](float x, float y) { return x + y; });
}
GraphNumber operator-(const GraphNumber& a, const GraphNumber& b) {
  return arithmetic(GraphOp::kSubtract, a, b, [](float x, float y) { return x - y; });
}
GraphNumber operator*(const GraphNumber& a, const GraphNumber& b) {
  if (a.builder->is(b, 1)) return a;
  if (a.builder->is(a, 1)) return b;
  return arithmetic(GraphOp::kMultiply, a, b, [](float x, float y) { return x * y; });
}
GraphNumber operator/(const GraphNumber& a, const GraphNumber& b) {
  return arithmetic(GraphOp::kDivide, a, b, [](float x, float y) { return y != 0 ? x / y : 0; });
}

}  // namespace lightmill
