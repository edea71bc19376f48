#pragma once
// Where manifold walks begin (walks/manifold_walk.h). Walks look for the ways by which a light shines through
// glass and off mirrors to a point. Photons have come those ways, or ways next to them. A grid lies over
// where photons arrived. Each cell's table has the lights that they came from, and for each light some
// photons that are unlike each other. Filled before rendering (training/manifold_training.h) and fixed then.
#include <algorithm>
#include <vector>

#include "worker/render/guiding/photon_blocks.h"

namespace lightmill {

/// A way by which a light shines to somewhere near.
struct ManifoldSeed {
  Vec3<float> p, normal;  // of the photon, and of the surface there
  Vec3<float> w;          // unit direction there to where it came from
  std::array<float, 9> turn{};
  SpecularEvents::Code events = 0;
};

/// The seeds of one light in a table.
struct ManifoldGroup {
  int32_t light = 0;
  float probability = 0;  // that a point of the table is joined to this light
  int32_t first = 0, count = 0;
  Vec3<float> axis;  // of the half of a spherical light that it comes from; 0: of all, or another light
};

struct ManifoldSeeds {
  static constexpr int kMost = 8;  // of a group
  PhotonGrid cells;
  struct Table {
    int32_t first = 0, count = 0;  // groups
    float irradiance = 0;          // that photons bring
  };
  std::vector<Table> tables;
  std::vector<ManifoldGroup> groups;
  std::vector<ManifoldSeed> seeds;
  bool meetable = false;   // camera paths can hit some of the lights
  float worth_a_walk = 0;  // irradiance from which on all vertices of throughput 1 walk
  double found = 0;        // part of what photons bring that walks from their places find

  bool empty() const { return tables.empty(); }
  /// Whether walks find nearly all of the light. Then light paths are not needed.
  bool suffice() const { return !empty() && found >= 0.99; }
  /// Probability that a vertex walks, for paths of at most `throughput` there. Where walks bring little, a
  /// few vertices do as well, each for many.
  float chance(const Table& table, float throughput) const {
    constexpr float kLeast = 1.0f / 16;
    return std::min(std::max(throughput * table.irradiance / worth_a_walk, kLeast), 1.0f);
  }
  /// The table at a point, or null.
  const Table* at(const Vec3<float>& p) const {
    const int32_t table = cells.table_of[static_cast<size_t>(cells.grid.at<float>(p))];
    return table < 0 ? nullptr : &tables[static_cast<size_t>(table)];
  }
  uint64_t bytes() const {
    return sizeof(int32_t) * cells.table_of.capacity() + sizeof(Table) * tables.capacity() +
           sizeof(ManifoldGroup) * groups.capacity() + sizeof(ManifoldSeed) * seeds.capacity();
  }
};

/// The group of the table at p for which `chosen(group, is_last)` is true, or null.
template <class Chosen>
const ManifoldGroup* group_at(const ManifoldSeeds& seeds, const Vec3<float>& p, Chosen&& chosen) {
  const ManifoldSeeds::Table* table = seeds.at(p);
  for (int32_t k = 0; table && k < table->count; ++k) {
    const ManifoldGroup& group = seeds.groups[static_cast<size_t>(table->first + k)];
    if (chosen(group, k + 1 == table->count)) return &group;
  }
  return nullptr;
}

/// Makes the seeds from the photons of `light_paths` light paths. Empty if there are none to speak of.
ManifoldSeeds make_manifold_seeds(const std::vector<Photon>& photons, double light_paths);

}  // namespace lightmill
