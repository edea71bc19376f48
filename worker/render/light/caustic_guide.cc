#include "worker/render/light/caustic_guide.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lightmill {
namespace {

/// Cells along the longest side of the grid, but one. A table is made of kEnough photons at least, of several
/// cells where they are few. Half and twice of each made no difference beyond noise.
constexpr int kMostCells = 48;
constexpr size_t kEnough = CausticGuide::kLeastPhotons;
/// No node of fewer photons is split by their flux, and none narrower than this, on a square of side 2.
constexpr size_t kSplit = 8;
constexpr float kNarrow = 0x1p-12f;

using Photons = std::vector<const Photon*>;

/// The cone around a window, by the points of a grid over it.
void add_cone(GuideWindow* w) {
  constexpr int kSteps = 16;
  std::vector<Vec3<float>> points;
  Vec3<float> sum;
  const auto at = [](float lo, float hi, int i) {
    return 0.5f * (lo + (hi - lo) * (static_cast<float>(i) / kSteps)) + 0.5f;
  };
  for (int i = 0; i <= kSteps; ++i) {
    for (int k = 0; k <= kSteps; ++k) {
      points.push_back(equal_area_square_to_sphere(at(w->x0, w->x1, i), at(w->y0, w->y1, k)));
      sum = sum + points.back();
    }
  }
  if (!(dot(sum, sum) > 1)) return;
  const Vec3<float> axis = normalize(sum);
  float least = 1;
  for (const Vec3<float>& p : points) least = std::min(least, dot(axis, p));
  // A step across the square is no more than three times as many radians.
  const float step = 3 * std::max(w->x1 - w->x0, w->y1 - w->y0) / kSteps;
  const float reach = std::acos(std::clamp(least, -1.0f, 1.0f)) + step;
  if (reach >= 3) return;
  w->axis = {axis.x, axis.y, axis.z};
  w->least_cosine = std::cos(reach) - 0x1p-20f;
}

GuideWindow window_of(const Photons& photons) {
  GuideWindow w;
  w.x0 = w.y0 = 1, w.x1 = w.y1 = -1;
  for (const Photon* p : photons) {
    w.x0 = std::min(w.x0, p->x), w.x1 = std::max(w.x1, p->x);
    w.y0 = std::min(w.y0, p->y), w.y1 = std::max(w.y1, p->y);
  }
  // A little more than what has been seen, and never a line.
  const auto widen = [](float* lo, float* hi) {
    const float more = 0.05f * (*hi - *lo) + 0x1p-9f;
    *lo = std::max(*lo - more, -1.0f);
    *hi = std::min(*hi + more, 1.0f);
  };
  widen(&w.x0, &w.x1);
  widen(&w.y0, &w.y1);
  add_cone(&w);
  return w;
}

/// The first of [first, last), which are more than one and ordered along the split, that is in the upper half
/// of their flux; not the first of all.
Photons::iterator halve(Photons::iterator first, Photons::iterator last) {
  double all = 0, below = 0;
  for (auto p = first; p != last; ++p) all += double{(*p)->power};
  auto middle = first;
  while (middle + 1 != last && below + 0.5 * double{(*middle)->power} < 0.5 * all)
    below += double{(*middle++)->power};
  return std::max(middle, first + 1);
}

/// Fills `splits` from `node` on, the root of [first, last) within `w`.
void split(size_t node, int level, const GuideWindow& w, Photons::iterator first, Photons::iterator last,
           float* splits) {
  if (level == CausticGuide::kLevels) return;
  const bool across_x = level % 2 == 0;
  const float lo = across_x ? w.x0 : w.y0, hi = across_x ? w.x1 : w.y1;
  const auto place = [&](const Photon* p) { return across_x ? p->x : p->y; };
  float at = 0.5f * (lo + hi);
  auto middle = first;
  if (static_cast<size_t>(last - first) >= kSplit && hi - lo > kNarrow) {
    std::stable_sort(first, last, [&](const Photon* a, const Photon* b) { return place(a) < place(b); });
    middle = halve(first, last);
    at = std::clamp(0.5f * (place(*(middle - 1)) + place(*middle)), lo + 0.25f * kNarrow,
                    hi - 0.25f * kNarrow);
  } else {
    middle = std::stable_partition(first, last, [&](const Photon* p) { return place(p) < at; });
  }
  splits[node] = at;
  GuideWindow below = w, above = w;
  (across_x ? below.x1 : below.y1) = at;
  (across_x ? above.x0 : above.y0) = at;
  split(2 * node, level + 1, below, first, middle, splits);
  split(2 * node + 1, level + 1, above, middle, last, splits);
}

void add_table(Photons photons, CausticGuide* guide) {
  const size_t first = guide->splits.size();
  guide->windows.push_back(window_of(photons));
  guide->splits.resize(first + CausticGuide::kNodes);
  split(1, 0, guide->windows.back(), photons.begin(), photons.end(), &guide->splits[first]);
}

/// The first cell of the block of 2^level cells a side that `cell` is in.
size_t block_of(const LightGrid& grid, int32_t cell, int level) {
  int32_t block = 0, stride = 1;
  for (const int32_t count : grid.cells) {
    block += (cell % count >> level << level) * stride;
    cell /= count;
    stride *= count;
  }
  return static_cast<size_t>(block);
}

}  // namespace

CausticGuide make_caustic_guide(const std::vector<Photon>& photons) {
  CausticGuide guide;
  std::vector<Vec3f> points;
  points.reserve(photons.size());
  for (const Photon& p : photons) points.push_back(p.p);
  guide.grid = place_grid(points, kMostCells);
  guide.table_of.assign(static_cast<size_t>(guide.grid.count()), -1);
  std::vector<int32_t> cell_of;
  cell_of.reserve(photons.size());
  for (const Photon& p : photons) cell_of.push_back(guide.grid.at<float>({p.p.x, p.p.y, p.p.z}));
  const auto levels = static_cast<int>(std::bit_width(static_cast<unsigned>(kMostCells)));
  for (int level = 0; level <= levels; ++level) {
    std::map<size_t, std::vector<size_t>> blocks;
    for (size_t i = 0; i < photons.size(); ++i) blocks[block_of(guide.grid, cell_of[i], level)].push_back(i);
    for (const auto& [block, members] : blocks) {
      const auto waits = [&](size_t i) { return guide.table_of[static_cast<size_t>(cell_of[i])] < 0; };
      if (members.size() < kEnough || std::none_of(members.begin(), members.end(), waits)) continue;
      const auto table = static_cast<int32_t>(guide.windows.size());
      Photons own;
      for (const size_t i : members) own.push_back(&photons[i]);
      add_table(std::move(own), &guide);
      for (const size_t i : members) {
        if (waits(i)) guide.table_of[static_cast<size_t>(cell_of[i])] = table;
      }
    }
  }
  if (guide.windows.empty()) return {};
  return guide;
}

}  // namespace lightmill
