#pragma once
// Participating media as a scene file describes them: even ones, and media that vary over a grid.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/spill/spill_array.h"
#include "common/scene/scene_values.h"

namespace lightmill {

/// Values over a box: at the centres of nx * ny * nz equal cells, x running fastest, and linear between them.
/// From half a cell within the box's faces they go to `outside`, which they have half a cell beyond (pbrt).
struct VolumeField {
  int nx = 1, ny = 1, nz = 1;
  int channels = 1;  // of a value; side by side
  Vec3d lo{0, 0, 0}, hi{1, 1, 1};
  float outside = 0;
  std::vector<float> values;  // finite, not negative
  /// Not empty: only some blocks of 8^3 cells have values, the others are `outside`. By block, x fastest:
  /// where its 8^3 values begin in `block_values`, or -1. Blocks may share theirs. One channel.
  std::vector<int32_t> blocks;
  std::shared_ptr<SpillArray<float>> block_values;

  /// The value of a cell, which exists.
  float at(int x, int y, int z, int channel = 0) const {
    if (!blocks.empty()) return in_block(x, y, z);
    const auto index = [](int i) { return static_cast<size_t>(i); };
    const size_t cell = (index(z) * index(ny) + index(y)) * index(nx) + index(x);
    return values[cell * index(channels) + index(channel)];
  }

 private:
  float in_block(int x, int y, int z) const {
    const auto index = [](int i) { return static_cast<size_t>(i); };
    const auto count = [&](int n) { return index((n + 7) / 8); };
    const int32_t first = blocks[(index(z / 8) * count(ny) + index(y / 8)) * count(nx) + index(x / 8)];
    if (first < 0) return outside;
    return block_values->data()[index(first) + index((z % 8 * 8 + y % 8) * 8 + x % 8)];
  }
};

/// pbrt's cloud: a density within [0, 1] made of noise at points of medium space, which gets thinner from y =
/// 0 to y = 1. `density` scales the noise, `frequency` is that of its coarsest octave, and `wispiness` how
/// much finer noise bends it.
struct CloudDensity {
  float density = 1, wispiness = 1, frequency = 5;
};

/// Grids of a file, which whoever renders reads. Medium space is the file's world.
struct VolumeFile {
  std::string path;                                      // resolved
  std::string density, temperature;                      // names of grids; the second may be empty
  double temperature_offset = 0, temperature_scale = 1;  // kelvin: (value - offset) * scale
};

/// Where a medium varies. Coefficients are per scene unit, whatever the transform.
struct MediumGrid {
  Transform medium_to_world;                   // affine, not singular
  int moves_to = -1;                           // as a shape's, of medium_to_world
  Vec3d lo{0, 0, 0}, hi{1, 1, 1};              // the box of medium space beyond which there is nothing
  std::shared_ptr<const VolumeField> density;  // a factor of both coefficients; or
  std::optional<CloudDensity> cloud;           // the same; or
  std::optional<VolumeFile> file;              // the same, with temperature and box; or none of them, and
  std::shared_ptr<const VolumeField> sigma_a, sigma_s;  // RGB in their place (null: they are constant)
  // What shines: MediumDescription::emission times the first of these that there are,
  std::shared_ptr<const VolumeField> emission;     // RGB, or one channel
  std::shared_ptr<const VolumeField> temperature;  // kelvin: and times a black body's colour; none below 100
};

/// A participating medium. Coefficients are per scene unit, any scale applied; `emission` is the radiance
/// that it would show in infinite depth if it only absorbed. The phase function is Henyey and Greenstein's
/// with mean cosine g in (-1, 1): g > 0 scatters forwards.
struct MediumDescription {
  std::string name;
  Rgb sigma_a{1, 1, 1}, sigma_s{1, 1, 1};
  Rgb emission;
  float g = 0;
  SourceLocation location;
  std::shared_ptr<const MediumGrid> grid = nullptr;  // null: the same everywhere
  std::string light_group = {};                      // of its emission, in the AOV `lightgroups`; empty: none
};
/// An upper bound of the radiance that it would show in infinite depth.
Rgb brightest(const MediumDescription& medium);
/// Whether it does nothing to light.
bool is_empty(const MediumDescription& medium);

/// The media on either side of a surface (indices into SceneDescription::media; -1: empty space); outside is
/// where its outward normal points. If both are the same, what passes stays in the medium that it came
/// through, as in pbrt.
struct MediumInterface {
  int inside = -1, outside = -1;
  bool transition() const { return inside != outside; }
  bool operator==(const MediumInterface&) const = default;
};

}  // namespace lightmill
