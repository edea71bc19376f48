// Building the light tree, in double and without libm's transcendentals: the same bits on every machine.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "worker/render/light/light_tree.h"

namespace lightmill {
namespace {

constexpr size_t kChildren = 8;
constexpr size_t kBuckets = 12;
/// Levels that a trail of 4 bits each can name. From kBalancedDepth on sets are halved, so that 2^31 lights
/// fit into the levels that are left.
constexpr int kMaxDepth = 16, kBalancedDepth = 5;
/// Rounding of the cosines in LightTree::shares, where a sine is formed from a cosine near 1.
constexpr double kCosineMargin = 2e-3;
/// Least intensity of a light relative to all: far below what any image shows, far above where
/// float underflows.
constexpr double kLeastIntensity = 1e-30;

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

}  // namespace lightmill
