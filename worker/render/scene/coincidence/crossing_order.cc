#include "worker/render/scene/coincidence/crossing_order.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

namespace lightmill {
namespace {

constexpr int kMostSteps = 32;

/// How deep each medium lies in others, as the sheets' interfaces say: empty if they contradict each other.
std::map<int, int> medium_depths(const std::vector<Sheet>& sheets) {
  constexpr int kDeepest = 16;
  std::map<int, int> depth;
  for (const Sheet& s : sheets) {
    if (s.passes && s.media.transition()) depth[s.media.inside], depth[s.media.outside];
  }
  bool changes = true;
  for (int round = 0; changes; ++round) {
    if (round > kDeepest) return {};
    changes = false;
    for (const Sheet& s : sheets) {
      if (!s.passes || !s.media.transition()) continue;
      int& inside = depth[s.media.inside];
      const int least = depth[s.media.outside] + 1;
      changes = changes || inside < least;
      inside = std::max(inside, least);
    }
  }
  return depth;
}

}  // namespace

std::vector<size_t> crossing_order(const std::vector<Sheet>& sheets) {
  std::map<int, int> depths[2];
  for (const int facing : {-1, 1}) {
    std::vector<Sheet> alike;
    for (const Sheet& s : sheets) {
      if (s.facing == facing) alike.push_back(s);
    }
    depths[facing > 0] = medium_depths(alike);
  }
  bool all_flat = true;
  double largest_passed = 0;
  for (const Sheet& s : sheets) {
    all_flat = all_flat && s.flat;
    if (s.passes) largest_passed = std::max(largest_passed, s.size);
  }
  // From behind to the front, seen from where the sheet faces.
  const auto front = [&](const Sheet& s) {
    const bool decal = !s.passes && s.flat && s.size < largest_passed;
    int depth = 0;
    if (s.passes) {
      const auto& known = depths[s.facing > 0];
      const auto at = known.find(s.media.outside);
      if (at != known.end()) depth = at->second;
    }
    return std::tuple(s.passes ? 1 : decal ? 2 : 0, -depth, s.passes ? s.size : -s.size, s.place);
  };
  const auto group = [&](const Sheet& s) {
    if (all_flat && s.emits_one_sided) return s.facing > 0 ? 3 : 0;
    return s.facing > 0 ? 1 : 2;
  };
  std::vector<size_t> order(sheets.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t i, size_t j) {
    const Sheet &a = sheets[i], &b = sheets[j];
    if (group(a) != group(b)) return group(a) < group(b);
    return a.facing > 0 ? front(a) < front(b) : front(b) < front(a);
  });
  return order;
}

std::vector<int> steps_apart(const std::vector<Sheet>& sheets,
                             const std::vector<std::pair<size_t, size_t>>& touching) {
  const std::vector<size_t> order = crossing_order(sheets);
  std::vector<size_t> at(sheets.size());
  for (size_t i = 0; i < order.size(); ++i) at[order[i]] = i;
  std::vector<std::vector<size_t>> below(sheets.size());
  for (const auto& [a, b] : touching) at[a] < at[b] ? below[b].push_back(a) : below[a].push_back(b);
  std::vector<int> rank(sheets.size(), 0);
  size_t largest = order[0];
  for (const size_t i : order) {
    for (const size_t j : below[i]) rank[i] = std::max(rank[i], rank[j] + 1);
    const auto weight = [&](size_t s) { return std::tuple(-sheets[s].size, sheets[s].place); };
    if (weight(i) < weight(largest)) largest = i;
  }
  const int base = rank[largest];
  for (int& r : rank) r = std::clamp(r - base, -kMostSteps, kMostSteps);
  return rank;
}

}  // namespace lightmill
