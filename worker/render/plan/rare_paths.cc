#include "worker/render/plan/rare_paths.h"

#include <algorithm>

namespace lightmill {
namespace {

/// Octaves that the rarest paths span: log2 of their number, under Pareto's law of index 1.
constexpr double kOctavesMet = 4;
/// A render of half a minute on two cores takes about 64 times the pilot's samples.
constexpr double kOctavesMore = 6;

}  // namespace

void RarePaths::add(const RarePath& path) {
  if (paths_.size() == kMost) paths_.pop_back();
  const auto after =
      std::find_if(paths_.begin(), paths_.end(), [&](const RarePath& p) { return p.square < path.square; });
  paths_.insert(after, path);
}

void RarePaths::scale(float factor) {
  for (RarePath& path : paths_) {
    for (float& v : path.variance) v *= factor;
  }
}

std::array<double, kMaxPlans> unseen_variance(const std::vector<const RarePaths*>& cells) {
  std::vector<const RarePath*> rarest;
  for (const RarePaths* cell : cells) {
    for (const RarePath& path : cell->paths()) rarest.push_back(&path);
  }
  std::stable_sort(rarest.begin(), rarest.end(),
                   [](const RarePath* a, const RarePath* b) { return a->square > b->square; });
  if (rarest.size() > RarePaths::kMost) rarest.resize(RarePaths::kMost);
  std::array<double, kMaxPlans> sums{};
  for (const RarePath* path : rarest) {
    for (size_t k = 0; k < sums.size(); ++k)
      sums[k] += kOctavesMore / kOctavesMet * double{path->variance[k]};
  }
  return sums;
}

}  // namespace lightmill
