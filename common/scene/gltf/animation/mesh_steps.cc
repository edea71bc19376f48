#include "common/scene/gltf/animation/mesh_steps.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// The largest difference of a coordinate between `step` and what is half way between `a` and `b`.
double bend_between(const MeshStep& a, const MeshStep& b, const MeshStep& step) {
  double most = 0;
  for (size_t i = 0; i < step.positions.size(); ++i) {
    const Vec3f &p = a.positions[i], &q = b.positions[i], &r = step.positions[i];
    most = std::max({most, std::fabs(0.5 * (double{p.x} + q.x) - r.x),
                     std::fabs(0.5 * (double{p.y} + q.y) - r.y), std::fabs(0.5 * (double{p.z} + q.z) - r.z)});
  }
  return most;
}
double size_of(const MeshStep& step) {
  float low[3] = {1e38f, 1e38f, 1e38f}, high[3] = {-1e38f, -1e38f, -1e38f};
  for (const Vec3f& p : step.positions) {
    const float x[3] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], x[i]), high[i] = std::max(high[i], x[i]);
  }
  return std::max({0.0f, high[0] - low[0], high[1] - low[1], high[2] - low[2]});
}

}  // namespace

std::vector<MeshStep> steps_of(const GltfDeformer& deformer, const MeshStep& rest,
                               const GltfBending& bending) {
  constexpr size_t kMost = 64;
  constexpr double kMostBend = 5e-4;
  const auto at = [&](double s) { return deformer.bent(rest, bending.at(s)); };
  std::vector<MeshStep> steps{at(0), at(1)};
  const double allowed = kMostBend * size_of(steps[0]);
  for (size_t segments = 1; segments < kMost; segments *= 2) {
    std::vector<MeshStep> finer;
    double most = 0;
    for (size_t i = 0; i < segments; ++i) {
      MeshStep middle = at((static_cast<double>(i) + 0.5) / static_cast<double>(segments));
      most = std::max(most, bend_between(steps[i], steps[i + 1], middle));
      finer.push_back(std::move(steps[i]));
      finer.push_back(std::move(middle));
    }
    finer.push_back(std::move(steps[segments]));
    const bool straight = most <= allowed;
    if (straight) {  // every other step says as much
      steps.clear();
      for (size_t i = 0; i < finer.size(); i += 2) steps.push_back(std::move(finer[i]));
      break;
    }
    steps = std::move(finer);
  }
  const auto same = [&](const MeshStep& step) {
    return bend_between(steps[0], steps[0], step) <= 1e-9 * size_of(steps[0]);
  };
  if (std::all_of(steps.begin() + 1, steps.end(), same)) steps.resize(1);
  return steps;
}

void mend_later(TriangleMesh* mesh) {
  for (MeshStep& step : mesh->later) {
    for (size_t i = 0; i < step.positions.size(); ++i) {
      const Vec3f& p = step.positions[i];
      if (!std::isfinite(p.x + p.y + p.z)) step.positions[i] = mesh->positions[i];
    }
    for (size_t i = 0; i < step.normals.size(); ++i) {
      const Vec3f& n = step.normals[i];
      if (n.x == 0 && n.y == 0 && n.z == 0) step.normals[i] = mesh->normals[i];
    }
  }
}

}  // namespace lightmill
