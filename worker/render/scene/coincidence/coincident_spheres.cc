#include "worker/render/scene/coincidence/coincident_spheres.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "worker/render/scene/coincidence/crossing_order.h"

namespace lightmill {
namespace {

/// So many spheres that come next are looked at: enough for all that are in one place.
constexpr size_t kMostNext = 64;

double coordinate(const PlacedSphere& s) {
  double most = 0;
  for (size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(double{s.record[k]}));
  return most + double{s.record[3]};
}
double near(const PlacedSphere& s) { return same_within(coordinate(s), s.rounding); }

bool coincide(const PlacedSphere& a, const PlacedSphere& b) {
  bool same = true;
  for (size_t k = 0; k < 4; ++k)
    same = same && std::fabs(double{a.record[k]} - b.record[k]) <= std::max(near(a), near(b));
  return same;
}

/// Pairs of indices, the lower one first. Spheres in one place have one key, and few others have it, too.
std::vector<std::pair<size_t, size_t>> pairs_of(const std::vector<PlacedSphere>& spheres) {
  std::vector<std::pair<double, size_t>> keys;
  for (size_t i = 0; i < spheres.size(); ++i) {
    const auto& r = spheres[i].record;
    const double key = 0.3711 * r[0] + 0.2917 * r[1] + 0.3529 * r[2] + 0.4127 * r[3];
    if (r[3] > 0 && std::isfinite(key)) keys.emplace_back(key, i);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < keys.size(); ++i) {
    const PlacedSphere& a = spheres[keys[i].second];
    for (size_t j = i + 1; j < std::min(keys.size(), i + 1 + kMostNext); ++j) {
      if (keys[j].first - keys[i].first > 4 * near(a)) break;
      if (coincide(a, spheres[keys[j].second]))
        pairs.push_back(std::minmax({keys[i].second, keys[j].second}));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// To where the sphere is seen from, if it is opaque; else to its outside.
int facing(const SurfaceTraits& t, const PlacedSphere& s, bool has_viewer) {
  if (t.passes || t.one_sided) return t.flipped ? -1 : 1;
  const auto& r = s.record;
  return has_viewer && std::hypot(r[0], r[1], r[2]) < r[3] ? -1 : 1;
}

}  // namespace

CoincidentFaces separate_spheres(const std::vector<SurfaceTraits>& traits, const CoincidenceSpace& space,
                                 std::vector<PlacedSphere>* spheres) {
  CoincidentFaces found;
  std::map<size_t, std::vector<size_t>> stacks;  // by the first one
  std::map<size_t, size_t> first;
  std::set<size_t> touched;
  for (const auto& [a, b] : pairs_of(*spheres)) {
    PlacedSphere &one = (*spheres)[a], &other = (*spheres)[b];
    if (one.record[3] == 0 || other.record[3] == 0) continue;
    if (one.record == other.record && traits[a].flipped == traits[b].flipped) {
      if (traits[a].emits && traits[b].emits) continue;  // emitter_copies.h
      if (traits[a].same_surface(traits[b])) {
        touched.insert({a, b});
        other.record[3] = 0;
        continue;
      }
    }
    const size_t base = first.try_emplace(a, a).first->second;
    if (!first.try_emplace(b, base).second) continue;
    std::vector<size_t>& stack = stacks[base];
    if (stack.empty()) stack.push_back(base);
    stack.push_back(b);
    touched.insert({a, b});
  }
  for (auto& [base, stack] : stacks) {
    std::erase_if(stack, [&](size_t i) { return (*spheres)[i].record[3] == 0; });
    std::vector<Sheet> sheets;
    std::vector<std::pair<size_t, size_t>> touching;
    for (const size_t i : stack) {
      for (size_t k = sheets.size() - std::min(sheets.size(), kMostNext); k < sheets.size(); ++k)
        touching.emplace_back(k, sheets.size());
      const SurfaceTraits& t = traits[i];
      // Spheres are as shells: none is a decal of another.
      sheets.push_back(
          {facing(t, (*spheres)[i], space.has_viewer), t.passes, true, t.one_sided, t.media, 1, i});
    }
    const std::vector<int> steps = steps_apart(sheets, touching);
    for (size_t k = 0; k < stack.size(); ++k) {
      PlacedSphere& s = (*spheres)[stack[k]];
      const double step = kSetApart * coordinate(s) + space.more + 2 * near(s);
      const double radius = s.record[3];
      found.moved = std::max(found.moved, std::abs(steps[k]) * step);
      s.record[3] = static_cast<float>(std::max(radius + steps[k] * step, 0.5 * radius));
    }
  }
  found.faces = touched.size();
  for (const size_t i : touched) found.shapes.push_back(traits[i].location);
  return found;
}

}  // namespace lightmill
