#include "worker/render/light/light_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace lightmill {
namespace {

constexpr size_t kChildren = 8;
constexpr size_t kBuckets = 12;
/// Levels that a trail of 4 bits each can name; from kBalancedDepth on sets are halved, so that 2^31 lights
/// fit into what is left.
constexpr int kMaxDepth = 16, kBalancedDepth = 5;
/// Rounding of the cosines in shares(), where a sine is formed from a cosine near 1.
constexpr double kCosineMargin = 2e-3;
/// Cosine bounds below this count as this: near the horizon bounds are poor.
constexpr float kLeastCosine = 1.0f / 64;
/// No child that can contribute gets less than this: another may be hidden.
constexpr float kLeastShare = 1.0f / 1024;
/// Least intensity of a light relative to all, and least squared distance in the normalised space: far below
/// what any image shows, far above where float underflows.
constexpr double kLeastIntensity = 1e-30;
constexpr float kLeastDistance2 = 0x1p-80f;

constexpr float kLeastWeight = 1e-36f;
/// Float probabilities end here, not at 0.
constexpr float kLeastProbability = 1e-36f;

/// What a set of lights adds up to.
struct Sum {
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  double axis[3] = {0, 0, 0};
  double intensity = 0;
  size_t count = 0;

  void add(const LightBound& l, const double* reference_axis) {
    // A two-sided light has the axis of either sign: the one nearer to its neighbours.
    double sign = 1;
    if (l.two_sided && reference_axis != nullptr) {
      const double d =
          l.axis[0] * reference_axis[0] + l.axis[1] * reference_axis[1] + l.axis[2] * reference_axis[2];
      sign = d < 0 ? -1 : 1;
    }
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], l.lo[i]);
      hi[i] = std::max(hi[i], l.hi[i]);
      axis[i] += sign * l.axis[i] * l.intensity;
    }
    intensity += l.intensity;
    ++count;
  }
  void add(const Sum& s) {
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], s.lo[i]);
      hi[i] = std::max(hi[i], s.hi[i]);
      axis[i] += s.axis[i];
    }
    intensity += s.intensity;
    count += s.count;
  }
  /// Expected work of the set as one child: intensity x squared size x solid angle of emission. The latter by
  /// the resultant length R of the axes: a uniform cone of half angle t has R = (1 + cos t) / 2.
  double cost() const {
    if (count == 0) return 0;
    double diagonal2 = 0, resultant2 = 0;
    for (int i = 0; i < 3; ++i) {
      diagonal2 += (hi[i] - lo[i]) * (hi[i] - lo[i]);
      resultant2 += axis[i] * axis[i];
    }
    const double r = std::min(std::sqrt(resultant2) / intensity, 1.0);
    return intensity * diagonal2 * (4 - 3 * r);
  }
};

double centroid(const LightBound& l, size_t axis) { return 0.5 * (l.lo[axis] + l.hi[axis]); }

/// Splits lights[begin, end) (two or more) in two; returns where the second part begins.
size_t split(std::vector<LightBound>& lights, size_t begin, size_t end, bool balanced) {
  const auto first = lights.begin() + static_cast<std::ptrdiff_t>(begin),
             last = lights.begin() + static_cast<std::ptrdiff_t>(end);
  const size_t middle = begin + (end - begin) / 2;
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  for (auto l = first; l != last; ++l) {
    for (size_t i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], centroid(*l, i));
      hi[i] = std::max(hi[i], centroid(*l, i));
    }
  }
  size_t widest = 0;
  for (size_t i = 1; i < 3; ++i) {
    if (hi[i] - lo[i] > hi[widest] - lo[widest]) widest = i;
  }
  if (!(hi[widest] > lo[widest])) return middle;
  if (balanced || end - begin == 2) {
    std::nth_element(first, first + static_cast<std::ptrdiff_t>(middle - begin), last,
                     [&](const LightBound& a, const LightBound& b) {
                       const double ca = centroid(a, widest), cb = centroid(b, widest);
                       return ca != cb ? ca < cb : a.light < b.light;
                     });
    return middle;
  }
  const auto bucket = [&](const LightBound& l, size_t axis) {
    const double f = (centroid(l, axis) - lo[axis]) / (hi[axis] - lo[axis]) * double{kBuckets};
    return std::min(static_cast<size_t>(f), kBuckets - 1);
  };
  double best = INFINITY;
  size_t best_axis = widest, best_bucket = kBuckets / 2;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!(hi[axis] > lo[axis])) continue;
    Sum sums[kBuckets];
    for (auto l = first; l != last; ++l) sums[bucket(*l, axis)].add(*l, first->axis);
    double above[kBuckets];
    Sum s;
    for (size_t b = kBuckets; b-- > 1;) {
      s.add(sums[b]);
      above[b] = s.count > 0 ? s.cost() : INFINITY;
    }
    s = {};
    for (size_t b = 1; b < kBuckets; ++b) {
      s.add(sums[b - 1]);
      const double cost = s.count > 0 ? s.cost() + above[b] : INFINITY;
      if (cost < best) {
        best = cost;
        best_axis = axis;
        best_bucket = b;
      }
    }
  }
  const auto second = std::stable_partition(
      first, last, [&](const LightBound& l) { return bucket(l, best_axis) < best_bucket; });
  const auto at = static_cast<size_t>(second - lights.begin());
  return at > begin && at < end ? at : middle;
}

struct Child {
  size_t begin, end;
  double cost;
};

/// Bounds of lights[begin, end) as one child: sphere, and cone of axes.
struct ChildBound {
  double center[3], radius, axis[3] = {0, 0, 1}, cos_cone = -1, cos_emission = 1, intensity = 0;
  bool two_sided = true;
};
ChildBound bound_of(const std::vector<LightBound>& lights, size_t begin, size_t end) {
  ChildBound c;
  Sum sum;
  bool everywhere = false, mixed = false;
  for (size_t k = begin; k < end; ++k) {
    const LightBound& l = lights[k];
    sum.add(l, lights[begin].axis);
    c.cos_emission = std::min(c.cos_emission, l.cos_emission);
    everywhere = everywhere || (l.axis[0] == 0 && l.axis[1] == 0 && l.axis[2] == 0);
    mixed = mixed || l.two_sided != lights[begin].two_sided;
  }
  c.intensity = sum.intensity;
  c.two_sided = lights[begin].two_sided && !mixed && !everywhere;
  if (end - begin == 1) {
    std::copy(lights[begin].center, lights[begin].center + 3, c.center);
    c.radius = lights[begin].radius;
  } else {
    double d2 = 0;
    for (int i = 0; i < 3; ++i) {
      c.center[i] = 0.5 * (sum.lo[i] + sum.hi[i]);
      d2 += (sum.hi[i] - sum.lo[i]) * (sum.hi[i] - sum.lo[i]);
    }
    c.radius = 0.5 * std::sqrt(d2);
  }
  // Its float centre is off by half an ulp a component.
  c.radius = c.radius * (1 + 0x1p-20) +
             0x1p-22 * (std::fabs(c.center[0]) + std::fabs(c.center[1]) + std::fabs(c.center[2]));
  const double length =
      std::sqrt(sum.axis[0] * sum.axis[0] + sum.axis[1] * sum.axis[1] + sum.axis[2] * sum.axis[2]);
  if (everywhere || mixed || !(length > 1e-6 * sum.intensity)) return c;
  for (int i = 0; i < 3; ++i) c.axis[i] = sum.axis[i] / length;
  c.cos_cone = 1;
  for (size_t k = begin; k < end; ++k) {
    const double* a = lights[k].axis;
    const double d = a[0] * c.axis[0] + a[1] * c.axis[1] + a[2] * c.axis[2];
    c.cos_cone = std::min(c.cos_cone, c.two_sided ? std::fabs(d) : d);
  }
  return c;
}

}  // namespace

void LightTree::build(std::vector<LightBound> lights, int32_t light_count) {
  nodes_.clear();
  trail_.assign(static_cast<size_t>(light_count), 0);
  total_intensity_ = 0;
  for (const LightBound& l : lights) total_intensity_ += l.intensity;
  if (lights.empty()) return;
  for (LightBound& l : lights) l.intensity = std::max(l.intensity / total_intensity_, kLeastIntensity);
  add_node(lights, 0, lights.size(), 0, 0);
}

int32_t LightTree::add_node(std::vector<LightBound>& lights, size_t begin, size_t end, uint64_t trail,
                            int depth) {
  const auto index = static_cast<int32_t>(nodes_.size());
  nodes_.emplace_back();
  // The most expensive set is split until there are eight.
  std::vector<Child> sets{{begin, end, 0}};
  while (sets.size() < kChildren) {
    size_t worst = sets.size();
    for (size_t i = 0; i < sets.size(); ++i) {
      if (sets[i].end - sets[i].begin < 2) continue;
      if (worst == sets.size() || sets[i].cost > sets[worst].cost) worst = i;
    }
    if (worst == sets.size()) break;
    const size_t b = sets[worst].begin, e = sets[worst].end;
    const size_t m = split(lights, b, e, depth >= kBalancedDepth);
    const auto cost = [&](size_t from, size_t to) {
      if (depth >= kBalancedDepth) return static_cast<double>(to - from);
      Sum s;
      for (size_t k = from; k < to; ++k) s.add(lights[k], lights[from].axis);
      return s.cost();
    };
    sets[worst] = {b, m, cost(b, m)};
    sets.push_back({m, e, cost(m, e)});
  }
  Node node{};
  for (size_t i = 0; i < sets.size(); ++i) {
    const Child& set = sets[i];
    const ChildBound c = bound_of(lights, set.begin, set.end);
    node.x[i] = static_cast<float>(c.center[0]);
    node.y[i] = static_cast<float>(c.center[1]);
    node.z[i] = static_cast<float>(c.center[2]);
    node.radius[i] = static_cast<float>(c.radius);
    node.ax[i] = static_cast<float>(c.axis[0]);
    node.ay[i] = static_cast<float>(c.axis[1]);
    node.az[i] = static_cast<float>(c.axis[2]);
    node.cos_cone[i] = static_cast<float>(c.cos_cone);
    node.sin_cone[i] = static_cast<float>(std::sqrt(std::max(0.0, 1 - c.cos_cone * c.cos_cone)));
    node.cos_emission[i] = static_cast<float>(c.cos_emission - kCosineMargin);
    node.two_sided[i] = c.two_sided ? 1.0f : 0.0f;
    node.intensity[i] = static_cast<float>(c.intensity);
    const uint64_t here = trail | static_cast<uint64_t>(i + 1) << (4 * depth);
    if (set.end - set.begin == 1) {
      node.child[i] = ~lights[set.begin].light;
      trail_[static_cast<size_t>(lights[set.begin].light)] = here;
    } else {
      node.child[i] = add_node(lights, set.begin, set.end, here, depth + 1);
    }
  }
  static_assert(kMaxDepth * 4 <= 64);
  nodes_[static_cast<size_t>(index)] = node;
  return index;
}

Float8 LightTree::shares(const Node& n, const Vec3<float>& p) {
  using F = Float8;
  const F one = splat<F>(1.0f), zero{};
  const F dx = p.x - n.x, dy = p.y - n.y, dz = p.z - n.z;
  const F d2 = dx * dx + dy * dy + dz * dz, radius2 = n.radius * n.radius;
  const F inv_d = sqrt(1.0f / max(d2, kLeastDistance2));
  const Int8 inside = d2 <= radius2;
  const F along = (n.ax * dx + n.ay * dy + n.az * dz) * inv_d;
  const F cos_axis = clamp(select(Int8(n.two_sided > 0.0f), abs(along), along), -1.0f, 1.0f);
  const F sin_axis = sqrt(1.0f - cos_axis * cos_axis);
  // The least angle between the axis of a light in the child and the direction from it to p is
  // max(0, angle to the cone's axis - cone - angle under which the sphere is seen): here its cosine.
  const Int8 in_cone = cos_axis >= n.cos_cone;
  const F cos_off = select(in_cone, one, cos_axis * n.cos_cone + sin_axis * n.sin_cone);
  const F sin_off = select(in_cone, zero, sin_axis * n.cos_cone - cos_axis * n.sin_cone);
  const F sin_seen = min(n.radius * inv_d, one);
  const F cos_seen = sqrt(1.0f - sin_seen * sin_seen);
  const F cos_least = select(Int8(cos_off >= cos_seen), one, cos_off * cos_seen + sin_off * sin_seen);
  const F cosine = select(inside, one, cos_least);
  const F w = n.intensity * max(cosine, kLeastCosine) / max(max(d2, radius2), kLeastDistance2);
  const Int8 shines = (cosine > n.cos_emission) & (n.intensity > 0.0f);
  F weight = select(shines, max(w, kLeastWeight), zero);
  // Where nothing shines it does not matter what is chosen, but something must be.
  if (!any(Int8(weight > 0.0f))) weight = n.intensity;
  const auto sum = [](const F& x) {
    return ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
  };
  return select(Int8(weight > 0.0f), max(weight * (1.0f / sum(weight)), kLeastShare), zero);
}

namespace {

/// x[0], x[0] + x[1], ... in a fixed order.
Float8 running_sum(const Float8& x) {
  const auto shifted = [](const Float8& v, Int8 from, Int8 keep) {
    return select(keep, __builtin_shuffle(v, from), Float8{});
  };
  Float8 s = x + shifted(x, Int8{0, 0, 1, 2, 3, 4, 5, 6}, Int8{0, -1, -1, -1, -1, -1, -1, -1});
  s = s + shifted(s, Int8{0, 0, 0, 1, 2, 3, 4, 5}, Int8{0, 0, -1, -1, -1, -1, -1, -1});
  return s + shifted(s, Int8{0, 0, 0, 0, 0, 1, 2, 3}, Int8{0, 0, 0, 0, -1, -1, -1, -1});
}

}  // namespace

void LightTree::sample(const Vec3<float>* p, const double* u, unsigned lanes, Choice* choice) const {
  int32_t at[8] = {};
  double rest[8], probability[8];
  for (int l = 0; l < 8; ++l) {
    rest[l] = lanes >> l & 1 ? u[l] : 0;
    probability[l] = 1;
  }
  // All lanes go down a level at a time: their chains of dependent operations overlap.
  while (lanes != 0) {
    for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
      const auto l = static_cast<size_t>(std::countr_zero(bits));
      const Node& n = nodes_[static_cast<size_t>(at[l])];
      const Float8 share = shares(n, p[l]), end = running_sum(share);
      float ends[9] = {0};
      store(ends + 1, end);
      const double total = double{ends[8]}, x = rest[l] * total;
      // The first child that ends beyond x; it has a share, or it would not end beyond the one before.
      const unsigned before =
          mask_bits(Int8(end <= std::min(static_cast<float>(x), ends[8] * (1 - 0x1p-23f))));
      const auto i = static_cast<size_t>(std::popcount(before));
      const double size = double{ends[i + 1]} - double{ends[i]};
      probability[l] *= size / total;
      rest[l] = std::clamp((x - double{ends[i]}) / size, 0.0, 1 - 0x1p-53);
      at[l] = n.child[i];
      if (at[l] < 0) {
        choice[l] = {~at[l], std::max(static_cast<float>(probability[l]), kLeastProbability)};
        lanes &= ~(1u << l);
      }
    }
  }
}

void LightTree::probability(const Vec3<float>* p, const int32_t* light, unsigned lanes, float* result) const {
  uint64_t trail[8] = {};
  int32_t at[8] = {};
  double probability[8];
  for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
    const auto l = static_cast<size_t>(std::countr_zero(bits));
    trail[l] = trail_[static_cast<size_t>(light[l])];
    probability[l] = 1;
    if (trail[l] == 0) {
      result[l] = 0;
      lanes &= ~(1u << l);
    }
  }
  while (lanes != 0) {
    for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
      const auto l = static_cast<size_t>(std::countr_zero(bits));
      const Node& n = nodes_[static_cast<size_t>(at[l])];
      float ends[9] = {0};
      store(ends + 1, running_sum(shares(n, p[l])));
      const size_t i = (trail[l] & 15) - 1;
      probability[l] *= (double{ends[i + 1]} - double{ends[i]}) / double{ends[8]};
      at[l] = n.child[i];
      trail[l] >>= 4;
      if (trail[l] == 0 || !(probability[l] > 0)) {
        result[l] = probability[l] > 0 ? std::max(static_cast<float>(probability[l]), kLeastProbability) : 0;
        lanes &= ~(1u << l);
      }
    }
  }
}

}  // namespace lightmill
