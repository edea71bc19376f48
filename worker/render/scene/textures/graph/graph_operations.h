#pragma once
// What each operation of a texture graph does that needs nothing but its operands.
#include "worker/render/scene/textures/graph/cell_noise.h"
#include "worker/render/scene/textures/graph/color_spaces.h"

namespace lightmill::graph {

/// Between `count` values, or (`steps`) the one before.
template <class F>
inline F table_value(const float* values, int count, bool steps, bool beyond, F x) {
  const auto last = static_cast<float>(count - 1);
  const F at = usable(x) * last, inside = clamp(at, 0.0f, last);
  const F low = min(floor(inside), splat<F>(steps ? last : last - 1));
  const IntOf<F> i = to_int(low);
  const F a = gather(values, i);
  if (steps) return a;
  const F b = gather(values, i + 1);
  return a + (b - a) * ((beyond ? at : inside) - low);
}

/// f<D>() for the number of dimensions D.
template <class Function>
inline auto with_dimensions(int dimensions, const Function& f) {
  switch (dimensions) {
    case 1:
      return f.template operator()<1>();
    case 2:
      return f.template operator()<2>();
    case 3:
      return f.template operator()<3>();
    default:
      return f.template operator()<4>();
  }
}

/// Of one result. a: the operands.
template <class F>
inline F arithmetic(GraphOp op, const F* a) {
  const F one = splat<F>(1.0f);
  const auto truth = [&](MaskOf<F> m) { return select(m, one, F{}); };
  F s, c;
  switch (op) {
    case GraphOp::kAdd:
      return a[0] + a[1];
    case GraphOp::kSubtract:
      return a[0] - a[1];
    case GraphOp::kMultiply:
      return a[0] * a[1];
    case GraphOp::kDivide:
      return quotient(a[0], a[1]);
    case GraphOp::kMultiplyAdd:
      return a[0] * a[1] + a[2];
    case GraphOp::kPower:
      return power(a[0], a[1]);
    case GraphOp::kLogarithm:
      return quotient(logarithm(a[0]), logarithm(a[1]));
    case GraphOp::kSqrt:
      return safe_sqrt(a[0]);
    case GraphOp::kInverseSqrt:
      return quotient(one, safe_sqrt(a[0]));
    case GraphOp::kAbsolute:
      return abs(a[0]);
    case GraphOp::kExponent:
      return exponential(a[0]);
    case GraphOp::kMinimum:
      return min(a[0], a[1]);
    case GraphOp::kMaximum:
      return max(a[0], a[1]);
    case GraphOp::kLessThan:
      return truth(MaskOf<F>(a[0] < a[1]));
    case GraphOp::kGreaterThan:
      return truth(MaskOf<F>(a[0] > a[1]));
    case GraphOp::kSign:
      return truth(MaskOf<F>(a[0] > 0.0f)) - truth(MaskOf<F>(a[0] < 0.0f));
    case GraphOp::kCompare:
      return truth(MaskOf<F>(abs(a[0] - a[1]) <= max(a[2], splat<F>(1.1920929e-7f))));
    case GraphOp::kSmoothMinimum:
      return smooth_minimum(a[0], a[1], a[2]);
    case GraphOp::kRound:
      return floor(a[0] + 0.5f);
    case GraphOp::kFloor:
      return floor(a[0]);
    case GraphOp::kCeil:
      return -floor(-a[0]);
    case GraphOp::kTruncate:
      return truncate(a[0]);
    case GraphOp::kModulo:
      return remainder(a[0], a[1]);
    case GraphOp::kWrap:
      return wrapped(a[0], a[1], a[2]);
    case GraphOp::kSnap:
      return floor(quotient(a[0], a[1])) * a[1];
    case GraphOp::kPingPong:
      return ping_pong(a[0], a[1]);
    case GraphOp::kSine:
      sine_cosine(a[0], &s, &c);
      return s;
    case GraphOp::kCosine:
      sine_cosine(a[0], &s, &c);
      return c;
    case GraphOp::kTangent:
      sine_cosine(a[0], &s, &c);
      return quotient(s, c);
    case GraphOp::kArcsine:
      return arcsine(a[0]);
    case GraphOp::kArccosine:
      return arccosine(a[0]);
    case GraphOp::kArctangent:
      return arctangent2(a[0], one);
    case GraphOp::kArctan2:
      return arctangent2(a[0], a[1]);
    case GraphOp::kHyperbolicSine:
      return hyperbolic_sine(a[0]);
    case GraphOp::kHyperbolicCosine:
      return hyperbolic_cosine(a[0]);
    case GraphOp::kHyperbolicTangent:
      return hyperbolic_tangent(a[0]);
    case GraphOp::kChoose:
      return select(MaskOf<F>(a[0] > 0.0f), a[1], a[2]);
    default:
      return F{};
  }
}

/// r: the results.
template <class F>
inline void apply_operation(const GraphOperation& o, const float* tables, const F* a, F* r) {
  // Noise of one dimension is that of w.
  const F* const at = o.p == 1 ? a + 3 : a;
  switch (o.op) {
    case GraphOp::kRgbToHsv:
      return rgb_to_hues(a, false, r);
    case GraphOp::kRgbToHsl:
      return rgb_to_hues(a, true, r);
    case GraphOp::kHsvToRgb:
      return hues_to_rgb(a, false, r);
    case GraphOp::kHslToRgb:
      return hues_to_rgb(a, true, r);
    case GraphOp::kTable:
    case GraphOp::kSteps:
      r[0] = table_value(tables + o.p, o.q, o.op == GraphOp::kSteps, o.r != 0, a[0]);
      return;
    case GraphOp::kPerlin:
      r[0] = with_dimensions(o.p, [&]<int D>() { return lattice_noise<D, F>(at); });
      return;
    case GraphOp::kFractal:
      r[0] = with_dimensions(o.p, [&]<int D>() { return fractal_noise<D, F>(at, a[4], a[5]); });
      return;
    case GraphOp::kMusgrave:
      r[0] = with_dimensions(
          o.p, [&]<int D>() { return musgrave<D, F>(static_cast<MusgraveKind>(o.q), at, a + 4); });
      return;
    case GraphOp::kVoronoi:
      return with_dimensions(o.p, [&]<int D>() {
        voronoi<D, F>(static_cast<VoronoiFeature>(o.q), static_cast<VoronoiMetric>(o.r), at, a + 4, r);
      });
    case GraphOp::kWhiteNoise:
      return with_dimensions(o.p, [&]<int D>() { white_noise<D, F>(at, r); });
    case GraphOp::kBrick:
      return brick(a, o.p, o.q, r);
    default:
      r[0] = arithmetic(o.op, a);
  }
}

}  // namespace lightmill::graph
