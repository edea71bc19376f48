#include "worker/render/scene/media/volume_files.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/transform.h"
#include "common/scene/volume/volume_grid.h"
#include "worker/render/scene/lights/light_builder.h"

namespace lightmill {
namespace {

constexpr double kHottest = 1e6;

std::string file_of(const MediumDescription& m) {
  return place(m.location) + "the medium \"" + m.name + "\": the file ";
}

/// Whether the transform only stretches and moves, so that boxes stay boxes.
bool keeps_axes(const Transform& t) {
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column) {
      if (row != column && std::fabs(t.m[row][column]) > 1e-6 * std::fabs(t.m[row][row])) return false;
    }
    if (!(t.m[row][row] > 0)) return false;
  }
  return true;
}

/// Kelvin from the values of the file, and in the index space of the densities.
std::shared_ptr<const VolumeField> temperature(VolumeGrid grid, const VolumeFile& file,
                                               const Transform& to_density) {
  VolumeField field = std::move(grid.field);
  const auto kelvin = [&](float x) {
    return static_cast<float>(
        std::clamp((x - file.temperature_offset) * file.temperature_scale, 0.0, kHottest));
  };
  for (float& x : field.block_values->span()) x = kelvin(x);
  field.outside = kelvin(0);
  field.lo = transform_point(to_density, field.lo);
  field.hi = transform_point(to_density, field.hi);
  return std::make_shared<const VolumeField>(std::move(field));
}

}  // namespace

MediumDescription with_file_read(const MediumDescription& medium, const std::shared_ptr<SpillArea>& area,
                                 std::vector<Problem>* warnings) {
  if (!medium.grid || !medium.grid->file) return medium;
  const VolumeFile& file = *medium.grid->file;
  const auto warn = [&](const std::string& what) {
    warnings->push_back({medium.location, Severity::kWarning, "the medium \"" + medium.name + "\": " + what});
  };
  const auto read = [&](const std::string& name) {
    try {
      VolumeGrid grid = read_grid(file.path, name, area);
      if (grid.odd_values)
        warn("the grid \"" + name + "\" has values that are negative or no numbers; they are taken for 0");
      return grid;
    } catch (const Error& error) {
      throw Error(error.kind(), file_of(medium) + error.what());
    }
  };
  VolumeGrid density = read(file.density);
  MediumDescription out = medium;
  auto grid = std::make_shared<MediumGrid>();
  grid->moves_to = medium.grid->moves_to;
  grid->medium_to_world = medium.grid->medium_to_world * density.index_to_world;
  if (is_singular(grid->medium_to_world) || determinant3(grid->medium_to_world) == 0)
    throw Error(ErrorKind::kBadScene, file_of(medium) + "has a grid that its transform flattens");
  grid->lo = density.lo, grid->hi = density.hi;
  grid->density = std::make_shared<const VolumeField>(std::move(density.field));
  if (file.temperature.empty()) {
    out.emission = {};
  } else {
    VolumeGrid hot = read(file.temperature);
    const Transform to_density = inverse(density.index_to_world) * hot.index_to_world;
    if (keeps_axes(to_density)) {
      const Vec3d lo = transform_point(to_density, hot.lo), hi = transform_point(to_density, hot.hi);
      grid->lo = {std::min(grid->lo.x, lo.x), std::min(grid->lo.y, lo.y), std::min(grid->lo.z, lo.z)};
      grid->hi = {std::max(grid->hi.x, hi.x), std::max(grid->hi.y, hi.y), std::max(grid->hi.z, hi.z)};
      grid->temperature = temperature(std::move(hot), file, to_density);
    } else {
      warn("the grid \"" + file.temperature + "\" is turned against \"" + file.density +
           "\"; it is left out");
      out.emission = {};
    }
  }
  out.grid = std::move(grid);
  return out;
}

}  // namespace lightmill
