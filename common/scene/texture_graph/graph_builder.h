#pragma once
// Writes a texture graph down as if it were arithmetic:
//
//   GraphBuilder g;
//   const GraphVector p = g.point(g.space(world_to_object));
//   const GraphNumber wave = sine(p.x * 20.0f + 1.0f);
#include <initializer_list>
#include <map>
#include <vector>

#include "common/scene/texture_graph/texture_graph.h"

namespace lightmill {

class GraphBuilder;

/// Removes the operations that the output does not need.
void drop_unused(TextureGraph* graph);

/// An operand of a graph that is being built.
struct GraphNumber {
  GraphBuilder* builder = nullptr;
  int32_t operand = 0;
};
struct GraphVector {
  GraphNumber x, y, z;
};

class GraphBuilder {
 public:
  GraphNumber constant(float x);
  GraphVector constant(float x, float y, float z) { return {constant(x), constant(y), constant(z)}; }
  /// The value if it is a constant, else nullptr.
  const float* known(const GraphNumber& x) const;
  bool is(const GraphNumber& x, float value) const { return known(x) && *known(x) == value; }

  /// Adds an operation. Returns its first result; result k is at(first, k).
  GraphNumber add(GraphOp op, std::initializer_list<GraphNumber> operands, int32_t p = 0, int32_t q = 0,
                  int32_t r = 0);
  static GraphNumber at(const GraphNumber& first, int32_t k) { return {first.builder, first.operand + k}; }
  static GraphVector triple(const GraphNumber& first) { return {first, at(first, 1), at(first, 2)}; }

  GraphNumber input(GraphInput which) { return add(GraphOp::kInput, {}, static_cast<int32_t>(which)); }
  GraphVector point(int32_t space) { return triple(add(GraphOp::kPoint, {}, space)); }
  /// Number of a space, to which `t` leads from the scene's.
  int32_t space(const Transform& t);
  /// Appends floats for kTable and kSteps. Returns where they begin.
  int32_t table(const std::vector<float>& values);

  /// The graph, of which nothing that `output` does not need is left.
  TextureGraph finish(const GraphVector& output);
  size_t operations() const { return graph_.operations.size(); }

 private:
  TextureGraph graph_;
  std::map<uint32_t, int32_t> constants_;  // by their bits
};

// Sums of constants are worked out at once.
GraphNumber operator+(const GraphNumber& a, const GraphNumber& b);
GraphNumber operator-(const GraphNumber& a, const GraphNumber& b);
GraphNumber operator*(const GraphNumber& a, const GraphNumber& b);
/// 0 where b is 0.
GraphNumber operator/(const GraphNumber& a, const GraphNumber& b);
inline GraphNumber operator+(const GraphNumber& a, float b) { return a + a.builder->constant(b); }
inline GraphNumber operator-(const GraphNumber& a, float b) { return a - a.builder->constant(b); }
inline GraphNumber operator*(const GraphNumber& a, float b) { return a * a.builder->constant(b); }
inline GraphNumber operator/(const GraphNumber& a, float b) { return a / a.builder->constant(b); }
inline GraphNumber operator-(float a, const GraphNumber& b) { return b.builder->constant(a) - b; }

inline GraphNumber apply(GraphOp op, const GraphNumber& a) { return a.builder->add(op, {a}); }
inline GraphNumber apply(GraphOp op, const GraphNumber& a, const GraphNumber& b) {
  return a.builder->add(op, {a, b});
}
inline GraphNumber apply(GraphOp op, const GraphNumber& a, const GraphNumber& b, const GraphNumber& c) {
  return a.builder->add(op, {a, b, c});
}
inline GraphNumber minimum(const GraphNumber& a, const GraphNumber& b) {
  return apply(GraphOp::kMinimum, a, b);
}
inline GraphNumber maximum(const GraphNumber& a, const GraphNumber& b) {
  return apply(GraphOp::kMaximum, a, b);
}
inline GraphNumber unit_clamp(const GraphNumber& x) {
  return minimum(maximum(x, x.builder->constant(0)), x.builder->constant(1));
}
inline GraphNumber choose(const GraphNumber& a, const GraphNumber& if_positive,
                          const GraphNumber& otherwise) {
  return apply(GraphOp::kChoose, a, if_positive, otherwise);
}
inline GraphNumber sine(const GraphNumber& x) { return apply(GraphOp::kSine, x); }
inline GraphNumber cosine(const GraphNumber& x) { return apply(GraphOp::kCosine, x); }
inline GraphNumber square_root(const GraphNumber& x) { return apply(GraphOp::kSqrt, x); }
inline GraphNumber floor_of(const GraphNumber& x) { return apply(GraphOp::kFloor, x); }
inline GraphNumber absolute(const GraphNumber& x) { return apply(GraphOp::kAbsolute, x); }
/// a + (b - a) t
inline GraphNumber blend(const GraphNumber& a, const GraphNumber& b, const GraphNumber& t) {
  return a + (b - a) * t;
}

/// f of each component.
template <class Function>
GraphVector each(const GraphVector& a, const Function& f) {
  return {f(a.x), f(a.y), f(a.z)};
}
template <class Function>
GraphVector each(const GraphVector& a, const GraphVector& b, const Function& f) {
  return {f(a.x, b.x), f(a.y, b.y), f(a.z, b.z)};
}
template <class Function>
GraphVector each(const GraphVector& a, const GraphVector& b, const GraphVector& c, const Function& f) {
  return {f(a.x, b.x, c.x), f(a.y, b.y, c.y), f(a.z, b.z, c.z)};
}
inline GraphVector operator+(const GraphVector& a, const GraphVector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline GraphVector operator-(const GraphVector& a, const GraphVector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline GraphVector operator*(const GraphVector& a, const GraphVector& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
inline GraphVector operator*(const GraphVector& a, const GraphNumber& s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline GraphVector operator*(const GraphVector& a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline GraphVector blend(const GraphVector& a, const GraphVector& b, const GraphNumber& t) {
  return {blend(a.x, b.x, t), blend(a.y, b.y, t), blend(a.z, b.z, t)};
}
inline GraphNumber dot(const GraphVector& a, const GraphVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline GraphVector cross(const GraphVector& a, const GraphVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline GraphNumber length(const GraphVector& a) { return square_root(dot(a, a)); }
/// Of length 1, or zero.
inline GraphVector normalized(const GraphVector& a) {
  const GraphNumber l = length(a);
  return a * (l.builder->constant(1) / l);
}
/// Coefficients of luminance of linear Rec.709.
inline GraphNumber luminance(const GraphVector& c) {
  return c.x * 0.2126729f + c.y * 0.7151522f + c.z * 0.0721750f;
}

}  // namespace lightmill
