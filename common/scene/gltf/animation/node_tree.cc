#include "common/scene/gltf/animation/node_tree.h"

#include <algorithm>
#include <cmath>

#include "common/scene/motion.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

/// From a quaternion (x, y, z, w) of any length; false if it has none.
bool rotation_of(const double* q, Transform* out) {
  const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(n > 1e-30) || !std::isfinite(n)) return false;
  const double s = 2 / n, x = q[0], y = q[1], z = q[2], w = q[3];
  *out = Transform{};
  out->m[0] = {1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), 0};
  out->m[1] = {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w), 0};
  out->m[2] = {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y), 0};
  return true;
}

Transform composed(const std::vector<double>& t, const Transform& rotation, const std::vector<double>& s) {
  return translation({t[0], t[1], t[2]}) * rotation * scaling({s[0], s[1], s[2]});
}

/// Whether what goes from `a` to `b` the straight way is at `middle` when it is `s` of the way there.
bool goes_straight(const Transform& a, const Transform& b, const Transform& middle, double s,
                   double way_length) {
  constexpr double kMost = 1e-3;
  const Transform straight = Motion(a, b).at(s);
  double size = 0, off = 0, shift = 0, place = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      size = std::max(size, std::fabs(middle.m[i][j]));
      off = std::max(off, std::fabs(middle.m[i][j] - straight.m[i][j]));
    }
    shift = std::max(shift, std::fabs(middle.m[i][3] - straight.m[i][3]));
    place = std::max(place, std::fabs(middle.m[i][3]));
  }
  // Beside rounding. Written so that NaN ends the search.
  return !(off > 0.1 * kMost * size || shift > kMost * way_length + 1e-12 * place);
}

}  // namespace

Transform rotation_at(const GltfValue& where, const double* q) {
  constexpr double kSlack = 0.01;
  Transform rotation;
  if (!rotation_of(q, &rotation)) {
    where.mended("is no rotation: all four are 0; it does not turn");
    return Transform{};
  }
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(n - 1) > kSlack) where.mended("is a quaternion of a length that is not 1; it is normalised");
  return rotation;
}

GltfNodeTree::GltfNodeTree(GltfScene& scene, const GltfValue& root, const GltfAnimations& animations,
                           const GltfExposure& exposure)
    : scene_(scene), root_(root.silent()), animations_(animations), exposure_(exposure) {
  scene_.attempt_optional([&] { find_parents(); });
}

void GltfNodeTree::find_parents() {
  const size_t count = root_.count("nodes");
  parent_.assign(count, -1);
  moves_.assign(count, false);
  for (size_t i = 0; i < count; ++i) {
    const GltfValue node = root_.require("nodes")[i];
    if (!node.is_object()) continue;
    for (size_t c = 0; c < node.count("children"); ++c) {
      // What is wrong with them is said where the scene is walked.
      const GltfValue index = node.require("children")[c];
      const double child = index.is_number() ? index.number(-1, 1e9) : -1;
      if (child >= 0 && child < static_cast<double>(count) && parent_[static_cast<size_t>(child)] < 0)
        parent_[static_cast<size_t>(child)] = static_cast<int>(i);
    }
  }
  // Rings of nodes are cut where they are entered: nothing of them is seen but joints.
  std::vector<int> mark(count, -1);
  for (size_t i = 0; i < count; ++i) {
    for (auto n = static_cast<int>(i); n >= 0 && mark[static_cast<size_t>(n)] < 0;) {
      mark[static_cast<size_t>(n)] = static_cast<int>(i);
      int& up = parent_[static_cast<size_t>(n)];
      if (up >= 0 && mark[static_cast<size_t>(up)] == static_cast<int>(i)) {
        scene_.mended("/nodes/" + std::to_string(n), "hangs from itself; its parent is left out");
        up = -1;
      }
      n = up;
    }
  }
  if (animations_.empty()) return;
  // Parents first, whatever their order in the file.
  std::vector<char> known(count, 0);
  std::vector<size_t> chain;
  for (size_t i = 0; i < count; ++i) {
    chain.clear();
    int n = static_cast<int>(i);
    for (; n >= 0 && !known[static_cast<size_t>(n)]; n = parent_[static_cast<size_t>(n)])
      chain.push_back(static_cast<size_t>(n));
    bool moved = n >= 0 && moves_[static_cast<size_t>(n)];
    for (auto k = chain.rbegin(); k != chain.rend(); ++k) {
      moved = moved || animations_.moves(*k);
      moves_[*k] = moved;
      known[*k] = 1;
    }
  }
}

Transform GltfNodeTree::local(const GltfValue& node) const {
  if (node.find("matrix")) {
    const auto m = node.numbers_or("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, -kLargestEntry,
                                   kLargestEntry);
    std::array<double, 16> columns;
    std::copy(m.begin(), m.end(), columns.begin());
    const Transform t = from_columns(columns);
    if (is_affine(t)) return t;
    node.require("matrix").mended("must have 0 0 0 1 as its last row; it gets that");
    Transform affine = t;
    affine.m[3] = {0, 0, 0, 1};
    return affine;
  }
  const auto t = node.numbers_or("translation", {0, 0, 0}, -kLargestEntry, kLargestEntry);
  const auto r = node.numbers_or("rotation", {0, 0, 0, 1}, -1e6, 1e6);
  const auto s = node.numbers_or("scale", {1, 1, 1}, -kLargestEntry, kLargestEntry);
  const auto given = node.find("rotation");
  return composed(t, given ? rotation_at(*given, r.data()) : Transform{}, s);
}

Transform GltfNodeTree::local_at(size_t node, double time) const {
  const GltfValue value = root_.require("nodes")[node];
  if (!animations_.moves(node) || time == exposure_.time) return local(value);
  auto t = value.numbers_or("translation", {0, 0, 0}, -kLargestEntry, kLargestEntry);
  auto r = value.numbers_or("rotation", {0, 0, 0, 1}, -1e6, 1e6);
  auto s = value.numbers_or("scale", {1, 1, 1}, -kLargestEntry, kLargestEntry);
  animations_.at(node, "translation", time, &t);
  animations_.at(node, "rotation", time, &r);
  animations_.at(node, "scale", time, &s);
  Transform rotation;
  if (!rotation_of(r.data(), &rotation)) rotation = Transform{};
  return composed(t, rotation, s);
}

Transform GltfNodeTree::to_world(size_t node, double time) {
  constexpr size_t kMostKept = 1 << 18;
  if (kept_ > kMostKept) {
    worlds_.clear();
    kept_ = 0;
  }
  auto& worlds = worlds_[time];
  if (const auto found = worlds.find(node); found != worlds.end()) return found->second;
  std::vector<size_t> chain;
  int n = static_cast<int>(node);
  for (; n >= 0 && !worlds.contains(static_cast<size_t>(n)); n = parent_[static_cast<size_t>(n)])
    chain.push_back(static_cast<size_t>(n));
  Transform t = n >= 0 ? worlds.at(static_cast<size_t>(n)) : Transform{};
  for (auto k = chain.rbegin(); k != chain.rend(); ++k) {
    t = t * local_at(*k, time);
    worlds[*k] = t;
  }
  kept_ += chain.size();
  return t;
}

std::vector<Transform> GltfNodeTree::way(size_t node) {
  constexpr int kMost = 64;
  const auto at = [&](double s) { return to_world(node, exposure_.at(s)); };
  for (int segments = 1;; segments *= 2) {
    std::vector<Transform> out;
    double length = 0;
    for (int i = 0; i <= segments; ++i) {
      out.push_back(at(static_cast<double>(i) / segments));
      if (i == 0) continue;
      const auto &a = out[out.size() - 2].m, &b = out.back().m;
      length += std::hypot(b[0][3] - a[0][3], b[1][3] - a[1][3], b[2][3] - a[2][3]);
    }
    bool straight = true;
    for (int i = 0; straight && segments < kMost && i < segments; ++i) {
      const auto k = static_cast<size_t>(i);
      // At uneven places: what turns often comes back at even ones.
      for (const double s : {0.21, 0.5, 0.83}) {
        straight = straight && goes_straight(out[k], out[k + 1], at((i + s) / segments), s, length);
      }
    }
    if (straight) return out;
  }
}

}  // namespace lightmill
