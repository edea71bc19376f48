#include "worker/render/guiding/manifold_seeds.h"

#include <algorithm>
#include <map>

namespace lightmill {
namespace {

/// Least photons of a table; and the number that is examined of each light there.
constexpr size_t kLeast = 16, kLookedAt = 256;
/// Tables spread over this many cells to where no photon came.
constexpr int kSpread = 2;
/// Lights of a table: those that bring most.
constexpr size_t kMostLights = 16;
/// A photon is as good as another if their directions, followed to the middle of the block, are this close
/// together, as a part of the spread of all of them there; or so close that a walk from either ends in the
/// same place.
constexpr float kAlike = 0.1f, kSame = 1e-4f;
/// Ways that bring less than this part of a light's photons together are left out.
constexpr double kLeft = 0.005;

float square(const Vec3<float>& v) { return dot(v, v); }

/// Photons that are alike.
struct Cluster {
  const Photon* first = nullptr;
  Vec3<float> there;
  double power = 0;
};

/// Adds a photon of each of the clusters that bring nearly all.
void add_group(const std::vector<const Photon*>& photons, const Vec3<float>& middle, ManifoldSeeds* seeds) {
  std::vector<const Photon*> own;
  const size_t stride = (photons.size() + kLookedAt - 1) / kLookedAt;
  for (size_t i = 0; i < photons.size(); i += stride) own.push_back(photons[i]);
  const float each = 1 / static_cast<float>(own.size());
  Vec3<float> mean;
  for (const Photon* p : own) mean = mean + p->w * each;
  float spread = 0;
  for (const Photon* p : own) spread += square(p->w - mean) * each;
  const float alike = std::max(kAlike * kAlike * spread, kSame * kSame);
  std::vector<Cluster> clusters;
  double all = 0;
  for (const Photon* p : own) {
    const Vec3<float> there = followed(p->p, p->w, p->turn, middle);
    const auto same = [&](const Cluster& c) {
      return c.first->events == p->events && square(c.there - there) <= alike;
    };
    auto at = std::find_if(clusters.begin(), clusters.end(), same);
    if (at == clusters.end()) at = clusters.insert(at, {p, there});
    at->power += double{p->power};
    all += double{p->power};
  }
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const Cluster& a, const Cluster& b) { return a.power > b.power; });
  double left = all;
  for (size_t i = 0; i < clusters.size() && i < ManifoldSeeds::kMost && left > kLeft * all; ++i) {
    const Photon& p = *clusters[i].first;
    seeds->seeds.push_back({p.p, p.normal, p.w, p.turn, p.events.code()});
    left -= clusters[i].power;
  }
}

/// Axis of the directions in which light leaves; 0 if they go all ways.
Vec3<float> axis_of(const std::vector<const Photon*>& photons) {
  Vec3<float> sum;
  for (const Photon* p : photons) sum = sum + p->emitted;
  const float length = std::sqrt(square(sum));
  return length > 0.9f * static_cast<float>(photons.size()) ? sum * (1 / length) : Vec3<float>();
}

void add_table(const std::vector<const Photon*>& photons, const GuideBox& box, ManifoldSeeds* seeds) {
  struct OfLight {
    std::vector<const Photon*> photons;
    double power = 0;
    int32_t light = -1;
  };
  std::map<int32_t, OfLight> by_light;
  for (const Photon* p : photons) {
    OfLight& l = by_light[p->light];
    l.light = p->light;
    l.photons.push_back(p);
    l.power += double{p->power};
  }
  std::vector<OfLight> lights;
  lights.reserve(by_light.size());
  for (auto& [light, l] : by_light) lights.push_back(std::move(l));
  std::stable_sort(lights.begin(), lights.end(),
                   [](const OfLight& a, const OfLight& b) { return a.power > b.power; });
  if (lights.size() > kMostLights) lights.resize(kMostLights);
  double all = 0;
  for (const OfLight& l : lights) all += l.power;
  const auto first_group = static_cast<int32_t>(seeds->groups.size());
  for (const OfLight& l : lights) {
    const auto first = static_cast<int32_t>(seeds->seeds.size());
    add_group(l.photons, {box.centre[0], box.centre[1], box.centre[2]}, seeds);
    seeds->groups.push_back({l.light, static_cast<float>(l.power / all), first,
                             static_cast<int32_t>(seeds->seeds.size()) - first, axis_of(l.photons)});
  }
  seeds->tables.push_back({first_group, static_cast<int32_t>(seeds->groups.size()) - first_group});
}

/// Gives cells that no photon came to the table of a cell beside them: where few came, others would have.
void spread(const LightGrid& grid, std::vector<int32_t>* table_of) {
  const std::vector<int32_t> before = *table_of;
  const int32_t columns = grid.cells[0], rows = grid.cells[1], layers = grid.cells[2];
  const auto index = [&](int x, int y, int z) { return static_cast<size_t>((z * rows + y) * columns + x); };
  for (int z = 0; z < layers; ++z) {
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        int32_t& table = (*table_of)[index(x, y, z)];
        for (int k = 0; k < 27 && table < 0; ++k) {
          const int nx = x + k % 3 - 1, ny = y + k / 3 % 3 - 1, nz = z + k / 9 - 1;
          if (nx >= 0 && nx < columns && ny >= 0 && ny < rows && nz >= 0 && nz < layers)
            table = before[index(nx, ny, nz)];
        }
      }
    }
  }
}

/// Irradiance that comes to the cells of each table, which are cubes, over their faces: as if a flat surface
/// went through each.
void find_irradiance(const std::vector<Photon>& photons, double light_paths, ManifoldSeeds* seeds) {
  const LightGrid& grid = seeds->cells.grid;
  const std::vector<int32_t>& table_of = seeds->cells.table_of;
  std::vector<double> power(seeds->tables.size()), cells(power.size());
  for (const int32_t table : table_of) {
    if (table >= 0) ++cells[static_cast<size_t>(table)];
  }
  for (const Photon& p : photons)
    power[static_cast<size_t>(table_of[static_cast<size_t>(grid.at<float>(p.p))])] += double{p.power};
  const auto per_unit = double{grid.per_unit[0]};
  for (size_t t = 0; t < power.size(); ++t)
    seeds->tables[t].irradiance =
        static_cast<float>(power[t] * per_unit * per_unit / (light_paths * cells[t]));
}

}  // namespace

ManifoldSeeds make_manifold_seeds(const std::vector<Photon>& photons, double light_paths) {
  ManifoldSeeds seeds;
  seeds.cells = tabulate(photons, kLeast, [&](const std::vector<const Photon*>& own, const GuideBox& box) {
    add_table(own, box, &seeds);
  });
  if (seeds.empty()) return {};
  find_irradiance(photons, light_paths, &seeds);
  for (int i = 0; i < kSpread; ++i) spread(seeds.cells.grid, &seeds.cells.table_of);
  return seeds;
}

}  // namespace lightmill
