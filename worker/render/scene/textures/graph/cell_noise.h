#pragma once
// Patterns of cells: Worley's noise (Voronoi), white noise, bricks. Hashes are those of Cycles, of the bits
// of a cell's coordinates.
#include "worker/render/scene/textures/graph/lattice_noise.h"

namespace lightmill::graph {

template <class F>
inline F hash_of(int count, F x, F y, F z, F w) {
  return unit_hash<F>(jenkins_hash_words(count, float_bits(x), float_bits(y), float_bits(z), float_bits(w)));
}

/// As many numbers in [0, 1] as there are dimensions.
template <int D, class F>
inline void cell_point(const F* k, F out[D]) {
  const F one = splat<F>(1.0f), two = splat<F>(2.0f);
  if constexpr (D == 1) out[0] = hash_of(1, k[0], one, one, one);
  if constexpr (D == 2) out[0] = hash_of(2, k[0], k[1], one, one), out[1] = hash_of(3, k[0], k[1], one, one);
  if constexpr (D == 3) {
    out[0] = hash_of(3, k[0], k[1], k[2], one);
    out[1] = hash_of(4, k[0], k[1], k[2], one);
    out[2] = hash_of(4, k[0], k[1], k[2], two);
  }
  if constexpr (D == 4) {
    out[0] = hash_of(4, k[0], k[1], k[2], k[3]);
    out[1] = hash_of(4, k[3], k[0], k[1], k[2]);
    out[2] = hash_of(4, k[2], k[3], k[0], k[1]);
    out[3] = hash_of(4, k[1], k[2], k[3], k[0]);
  }
}
template <int D, class F>
inline void cell_color(const F* k, F out[3]) {
  const F one = splat<F>(1.0f), two = splat<F>(2.0f);
  if constexpr (D == 3) return cell_point<3>(k, out);
  if constexpr (D == 4) {
    out[0] = hash_of(4, k[0], k[1], k[2], k[3]);
    out[1] = hash_of(4, k[2], k[0], k[3], k[1]);
    out[2] = hash_of(4, k[3], k[2], k[1], k[0]);
    return;
  }
  if constexpr (D <= 2) {
    const F y = k[D - 1];  // of one dimension it is not looked at
    out[0] = hash_of(D, k[0], y, one, one);
    out[1] = D == 1 ? hash_of(2, k[0], one, one, one) : hash_of(3, k[0], y, one, one);
    out[2] = D == 1 ? hash_of(2, k[0], two, one, one) : hash_of(3, k[0], y, two, one);
  }
}

template <int D, class F>
inline F metric_length(VoronoiMetric metric, const F d[D], F exponent) {
  F sum{};
  if (D == 1) return abs(d[0]);
  for (int i = 0; i < D; ++i) {
    const F a = abs(d[i]);
    sum = metric == VoronoiMetric::kChebychev   ? max(sum, a)
          : metric == VoronoiMetric::kManhattan ? sum + a
          : metric == VoronoiMetric::kEuclidean ? sum + a * a
                                                : sum + power(a, exponent);
  }
  if (metric == VoronoiMetric::kEuclidean) return sqrt(sum);
  return metric == VoronoiMetric::kMinkowski ? power(sum, quotient(splat<F>(1.0f), exponent)) : sum;
}

constexpr int cells_around(int dimensions, int reach) {
  int n = 1;
  for (int i = 0; i < dimensions; ++i) n *= 2 * reach + 1;
  return n;
}

/// Calls visit(offset) for all cells within `reach`, along the first axis first.
template <int D, class Visit>
inline void visit_cells(int reach, const Visit& visit) {
  for (int n = 0; n < cells_around(D, reach); ++n) {
    float offset[D];
    for (int i = 0, left = n; i < D; ++i, left /= 2 * reach + 1)
      offset[i] = static_cast<float>(left % (2 * reach + 1) - reach);
    visit(offset);
  }
}

/// The cells around a point: where their own points are.
template <int D, class F>
struct CellGrid {
  F cell[D], local[D];  // the point's cell, and the point within it
  F randomness;

  CellGrid(const F* at, F random) : randomness(clamp(random, 0.0f, 1.0f)) {
    for (int i = 0; i < D; ++i) {
      const F x = usable(at[i]);
      cell[i] = floor(x);
      local[i] = x - cell[i];
    }
  }
  /// The point of the cell at `offset`, as seen from the cell.
  template <class Offset>
  void point(const Offset* offset, F p[D]) const {
    F k[D], h[D];
    for (int i = 0; i < D; ++i) k[i] = cell[i] + offset[i];
    cell_point<D, F>(k, h);
    for (int i = 0; i < D; ++i) p[i] = h[i] * randomness + offset[i];
  }
  void color(const F* offset, F c[3]) const {
    F k[D];
    for (int i = 0; i < D; ++i) k[i] = cell[i] + offset[i];
    cell_color<D, F>(k, c);
  }
};

template <int D, class F>
inline F squared_length(const F v[D]) {
  F sum{};
  for (int i = 0; i < D; ++i) sum = sum + v[i] * v[i];
  return sum;
}

constexpr float kBeyond = 8;  // farther than any point that is looked at

/// out: distance, colour, position (x, y, z), w.
template <int D, class F>
void write_cell(const CellGrid<D, F>& grid, F distance, const F* offset, const F* position, F out[8]) {
  out[0] = distance;
  grid.color(offset, out + 1);
  for (int i = 0; i < D; ++i) out[D == 1 ? 7 : 4 + i] = position[i] + grid.cell[i];
}

template <int D, class F>
void nearest_cell(const CellGrid<D, F>& grid, bool second, VoronoiMetric metric, F exponent, F out[8]) {
  F least = splat<F>(kBeyond), next = least, offset[2][D]{}, position[2][D]{};
  visit_cells<D>(1, [&](const float* o) {
    F p[D], d[D];
    grid.point(o, p);
    for (int i = 0; i < D; ++i) d[i] = p[i] - grid.local[i];
    const F distance = metric_length<D, F>(metric, d, exponent);
    const MaskOf<F> first = MaskOf<F>(distance < least), other = MaskOf<F>(distance < next);
    for (int i = 0; i < D; ++i) {
      offset[1][i] = select(first, offset[0][i], select(other, splat<F>(o[i]), offset[1][i]));
      position[1][i] = select(first, position[0][i], select(other, p[i], position[1][i]));
      offset[0][i] = select(first, splat<F>(o[i]), offset[0][i]);
      position[0][i] = select(first, p[i], position[0][i]);
    }
    next = select(first, least, select(other, distance, next));
    least = select(first, distance, least);
  });
  write_cell<D, F>(grid, second ? next : least, offset[second], position[second], out);
}

template <int D, class F>
void smooth_cell(const CellGrid<D, F>& grid, VoronoiMetric metric, F exponent, F smoothness, F out[8]) {
  const F width = clamp(smoothness * 0.5f, 0.0f, 0.5f);
  F distance = splat<F>(kBeyond), color[3]{}, position[D]{};
  visit_cells<D>(2, [&](const float* o) {
    F p[D], d[D], c[3], offset[D];
    grid.point(o, p);
    for (int i = 0; i < D; ++i) d[i] = p[i] - grid.local[i], offset[i] = splat<F>(o[i]);
    const F x = metric_length<D, F>(metric, d, exponent);
    const F t = clamp(quotient(distance - x, width) * 0.5f + 0.5f, 0.0f, 1.0f),
            sharp = select(MaskOf<F>(x < distance), splat<F>(1.0f), F{});
    const F h = select(MaskOf<F>(width == 0.0f), sharp, t * t * (3.0f - 2.0f * t));
    F correction = width * h * (1.0f - h);
    distance = blend(distance, x, h) - correction;
    correction = correction / (width * 3.0f + 1.0f);
    grid.color(offset, c);
    for (int i = 0; i < 3; ++i) color[i] = blend(color[i], c[i], h) - correction;
    for (int i = 0; i < D; ++i) position[i] = blend(position[i], p[i], h) - correction;
  });
  F none[D]{};
  write_cell<D, F>(grid, distance, none, position, out);
  for (int i = 0; i < 3; ++i) out[1 + i] = color[i];
}

/// Distance to the plane halfway to the nearest neighbour's point.
template <int D, class F>
F distance_to_edge(const CellGrid<D, F>& grid) {
  F least = splat<F>(kBeyond), closest[D]{};
  const auto to_point = [&](const float* o, F v[D]) {
    grid.point(o, v);
    for (int i = 0; i < D; ++i) v[i] = v[i] - grid.local[i];
  };
  if constexpr (D == 1) {
    // Of one dimension the neighbours are those of the cell, not of the nearest point.
    const float middle = 0, before = -1, behind = 1;
    F m, l, r;
    grid.point(&middle, &m), grid.point(&before, &l), grid.point(&behind, &r);
    const F x = grid.local[0];
    return min(abs((m + l) * 0.5f - x), abs((m + r) * 0.5f - x));
  }
  visit_cells<D>(1, [&](const float* o) {
    F v[D];
    to_point(o, v);
    const F d = squared_length<D, F>(v);
    const MaskOf<F> nearer = MaskOf<F>(d < least);
    least = select(nearer, d, least);
    for (int i = 0; i < D; ++i) closest[i] = select(nearer, v[i], closest[i]);
  });
  F edge = splat<F>(kBeyond);
  visit_cells<D>(1, [&](const float* o) {
    F v[D], across[D], along{};
    to_point(o, v);
    for (int i = 0; i < D; ++i) across[i] = v[i] - closest[i];
    const F d = squared_length<D, F>(across);
    const MaskOf<F> other = MaskOf<F>(d > 1e-4f);
    for (int i = 0; i < D; ++i) along = along + (closest[i] + v[i]) * 0.5f * across[i];
    along = along / sqrt(select(other, d, splat<F>(1.0f)));
    edge = select(other, min(edge, along), edge);
  });
  return edge;
}

/// Half the distance from the nearest point to the one nearest to it.
template <int D, class F>
F sphere_radius(const CellGrid<D, F>& grid) {
  F least = splat<F>(kBeyond), closest[D]{}, closest_offset[D]{};
  visit_cells<D>(1, [&](const float* o) {
    F p[D], d[D];
    grid.point(o, p);
    for (int i = 0; i < D; ++i) d[i] = p[i] - grid.local[i];
    const F distance = sqrt(squared_length<D, F>(d));
    const MaskOf<F> nearer = MaskOf<F>(distance < least);
    least = select(nearer, distance, least);
    for (int i = 0; i < D; ++i) {
      closest[i] = select(nearer, p[i], closest[i]);
      closest_offset[i] = select(nearer, splat<F>(o[i]), closest_offset[i]);
    }
  });
  F radius = splat<F>(kBeyond);
  visit_cells<D>(1, [&](const float* o) {
    bool middle = true;
    F offset[D], p[D], d[D];
    for (int i = 0; i < D; ++i) middle = middle && o[i] == 0, offset[i] = closest_offset[i] + o[i];
    if (middle) return;
    grid.point(offset, p);
    for (int i = 0; i < D; ++i) d[i] = p[i] - closest[i];
    radius = min(radius, sqrt(squared_length<D, F>(d)));
  });
  return radius * 0.5f;
}

/// Operands: smoothness, exponent, randomness.
template <int D, class F>
[[gnu::noinline]] void voronoi(VoronoiFeature feature, VoronoiMetric metric, const F* at, const F operand[3],
                               F out[8]) {
  const CellGrid<D, F> grid(at, operand[2]);
  for (int i = 0; i < 8; ++i) out[i] = F{};
  switch (feature) {
    case VoronoiFeature::kF1:
    case VoronoiFeature::kF2:
      return nearest_cell(grid, feature == VoronoiFeature::kF2, metric, operand[1], out);
    case VoronoiFeature::kSmoothF1:
      return smooth_cell(grid, metric, operand[1], operand[0], out);
    case VoronoiFeature::kDistanceToEdge:
      out[0] = distance_to_edge(grid);
      return;
    case VoronoiFeature::kNSphereRadius:
      out[0] = sphere_radius(grid);
  }
}

/// out: value, colour.
template <int D, class F>
[[gnu::noinline]] void white_noise(const F* at, F out[4]) {
  cell_color<D, F>(at, out + 1);
  out[0] = out[1];
}

/// Operands: x, y, mortar size, smoothness, bias, width, height, offset, squash. out: tint, mortar.
template <class F>
[[gnu::noinline]] void brick(const F* operands, int offset_frequency, int squash_frequency, F out[2]) {
  F a[9];
  for (int i = 0; i < 9; ++i) a[i] = usable(operands[i]);
  const F x = a[0], y = a[1], height = a[6], one = splat<F>(1.0f);
  F width = a[5], shift{};
  const F row = floor(usable(quotient(y, height)));
  if (offset_frequency > 0 && squash_frequency > 0) {
    const auto every = [&](int n) {
      return MaskOf<F>(remainder(row, splat<F>(static_cast<float>(n))) == 0.0f);
    };
    width = width * select(every(squash_frequency), a[8], one);
    shift = select(every(offset_frequency), width * a[7], F{});
  }
  const F along = x + shift, number = floor(usable(quotient(along, width)));
  const F in_x = along - width * number, in_y = y - height * row;
  // A hash of row and brick.
  UintOf<F> n = (as_uint(to_int(row)) << 16) + (as_uint(to_int(number)) & 0xffffu);
  n = (n + 1013u) & 0x7fffffffu;
  n = (n >> 13) ^ n;
  const UintOf<F> m = (n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu;
  out[0] = clamp(to_float(as_int(m)) * (0.5f / 1073741824.0f) + a[4], 0.0f, 1.0f);
  const F edge = min(min(in_x, in_y), min(width - in_x, height - in_y));
  const F depth = 1.0f - quotient(edge, a[2]), t = quotient(depth, a[3]);
  const F smooth = select(MaskOf<F>(depth < a[3]), t * t * (3.0f - 2.0f * t), one);
  out[1] = select(MaskOf<F>(edge >= a[2]), F{}, smooth);
}

}  // namespace lightmill::graph
