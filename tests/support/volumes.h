#pragma once
// Media that vary over a grid, for tests.
#include <memory>

#include "tests/support/test_scene.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill::test {

/// A density without any pattern, in [0, most].
inline float random_density(int x, int y, int z, float most) {
  const uint32_t bits = hash32(static_cast<uint32_t>(x + 100 * (y + 100 * z)));
  return most * unit_float<float>(bits);
}

struct GridBox {
  int nx = 1, ny = 1, nz = 1;
  Vec3d lo{0, 0, 0}, hi{1, 1, 1};
  float outside = 0;
};

/// Values f(x, y, z) at the centres of a box's voxels.
template <class F>
std::shared_ptr<const VolumeField> field_of(const GridBox& box, F&& f) {
  auto field = std::make_shared<VolumeField>();
  field->nx = box.nx, field->ny = box.ny, field->nz = box.nz;
  field->lo = box.lo, field->hi = box.hi;
  field->outside = box.outside;
  const auto at = [](double lo, double hi, int i, int n) { return lo + (hi - lo) * (i + 0.5) / n; };
  for (int z = 0; z < box.nz; ++z) {
    for (int y = 0; y < box.ny; ++y) {
      for (int x = 0; x < box.nx; ++x) {
        field->values.push_back(
            static_cast<float>(f(at(box.lo.x, box.hi.x, x, box.nx), at(box.lo.y, box.hi.y, y, box.ny),
                                 at(box.lo.z, box.hi.z, z, box.nz))));
      }
    }
  }
  return field;
}

/// A grid whose box is the field's.
inline std::shared_ptr<MediumGrid> grid_of(std::shared_ptr<const VolumeField> density) {
  auto grid = std::make_shared<MediumGrid>();
  grid->lo = density->lo, grid->hi = density->hi;
  grid->density = std::move(density);
  return grid;
}

/// Adds a medium and returns its number.
inline int add_grid_medium(TestScene* s, const Rgb& sigma_a, const Rgb& sigma_s,
                           std::shared_ptr<const MediumGrid> grid, float g = 0, const Rgb& emission = {}) {
  s->scene.media.push_back({"grid", sigma_a, sigma_s, emission, g, {}, std::move(grid)});
  return static_cast<int>(s->scene.media.size()) - 1;
}

/// A box that bounds `medium`, and is no surface.
inline void bounding_box(TestScene* s, const Vec3d& lo, const Vec3d& hi, int medium, int outside = -1) {
  const size_t first = s->scene.shapes.size();
  s->box(lo, hi, s->diffuse(0));
  for (size_t i = first; i < s->scene.shapes.size(); ++i) {
    s->scene.shapes[i].media = {medium, outside};
    s->scene.shapes[i].boundary = true;
  }
}

}  // namespace lightmill::test
