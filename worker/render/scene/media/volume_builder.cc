#include "worker/render/scene/media/volume_builder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/spectrum/spectrum.h"
#include "common/scene/transform.h"
#include "worker/render/scene/lights/light_builder.h"
#include "worker/render/scene/media/cloud.h"
#include "worker/render/scene/media/volume_table.h"

namespace lightmill {
namespace {

/// Products of two of them stay within float.
constexpr double kDensest = 1e18;
/// Indices into the values are 32 bits.
constexpr size_t kMostValues = size_t{1} << 31;

using Counts = std::array<int, 3>;

Error bad_grid(const MediumDescription& m, const std::string& what) {
  return Error(ErrorKind::kBadScene, place(m.location) + "the medium \"" + m.name + "\" " + what);
}

/// One or more fields of the same lattice, side by side as the channels of one.
struct Lattice {
  Counts count{};  // voxels
  Vec3d lo, hi;
  int channels = 0;
  const VolumeField* fields[2] = {};  // by halves of the channels; null: `constants`
  float constants[2] = {};
  float factor = 1;

  float value(int x, int y, int z, int channel) const {
    const int half = channels == 6 ? channel / 3 : 0;
    const VolumeField* const f = fields[half];
    if (f == nullptr) return constants[half] * factor;
    if (x < 0 || y < 0 || z < 0 || x >= count[0] || y >= count[1] || z >= count[2])
      return f->outside * factor;
    return f->at(x, y, z, channel % f->channels) * factor;
  }
  /// Whether the brick whose first cell is `cell` touches no block of a field that has only some.
  bool is_absent(const Counts& cell) const {
    const VolumeField* const f = fields[0];
    if (channels != 1 || f->blocks.empty() || f->outside != 0) return false;
    constexpr int kBlock = 8;
    const auto blocks = [&](size_t axis) { return (count[axis] + kBlock - 1) / kBlock; };
    const auto first = [&](size_t axis) { return std::max(0, (cell[axis] - 1) / kBlock); };
    const auto last = [&](size_t axis) {
      return std::min(blocks(axis) - 1, (cell[axis] + kBrick - 1) / kBlock);
    };
    for (int z = first(2); z <= last(2); ++z) {
      for (int y = first(1); y <= last(1); ++y) {
        for (int x = first(0); x <= last(0); ++x) {
          if (f->blocks[static_cast<size_t>((z * blocks(1) + y) * blocks(0) + x)] >= 0) return false;
        }
      }
    }
    return true;
  }
};

Lattice lattice_of(const VolumeField& f, float factor = 1) {
  return {{f.nx, f.ny, f.nz}, f.lo, f.hi, f.channels, {&f, nullptr}, {}, factor};
}

/// Normalised space to the cell coordinates of the lattice: rows of an affine map.
Transform to_cells(const Lattice& l, const Transform& medium_to_world, const RenderScene& scene) {
  const double to_scene = std::ldexp(1.0, -scene.scale_exponent);
  const Vec3d size{l.hi.x - l.lo.x, l.hi.y - l.lo.y, l.hi.z - l.lo.z};
  const Transform from_box = translation({0.5, 0.5, 0.5}) *
                             scaling({l.count[0] / size.x, l.count[1] / size.y, l.count[2] / size.z}) *
                             translation({-l.lo.x, -l.lo.y, -l.lo.z});
  return from_box * inverse(medium_to_world) * translation(scene.origin) *
         scaling({to_scene, to_scene, to_scene});
}

class GridBuilder {
 public:
  GridBuilder(const MediumDescription& medium, RenderScene* scene)
      : medium_(medium), scene_(*scene), table_(scene->volumes) {}

  /// Appends the lattice's bricks, and its record at `record`. Returns the largest value of each brick; with
  /// channels for absorption and scattering, the largest sum of the two.
  std::vector<double> add_field(const Lattice& l, size_t record) {
    Counts bricks;
    for (size_t i = 0; i < 3; ++i) bricks[i] = l.count[i] / kBrick + 1;  // count + 1 cells
    const size_t first = table_.bricks.size();
    int32_t empty = -1;
    std::vector<double> largest;
    std::vector<float> block(static_cast<size_t>(l.channels) * kBrickValues);
    for (int z = 0; z < bricks[2]; ++z) {
      for (int y = 0; y < bricks[1]; ++y) {
        for (int x = 0; x < bricks[0]; ++x) {
          const bool any = fill(l, {x * kBrick, y * kBrick, z * kBrick}, &block);
          if (!any && empty >= 0) {
            table_.bricks.push_back(empty);
            largest.push_back(0);
            continue;
          }
          if (table_.values.size() + block.size() > kMostValues)
            throw bad_grid(medium_,
                           "has more voxels than there is room for: all grids together may have 2^31 "
                           "values; make it coarser");
          table_.bricks.push_back(static_cast<int32_t>(table_.values.size()));
          if (!any) empty = table_.bricks.back();
          table_.values.append(block.data(), block.size());
          largest.push_back(any ? largest_of(block, l.channels) : 0);
        }
      }
    }
    table_.majorants.resize(table_.bricks.size(), 0.0f);
    const Transform map = to_cells(l, medium_.grid->medium_to_world, scene_);
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 4; ++column)
        table_.records[record + kFieldMap + 4 * row + column] = static_cast<float>(map.m[row][column]);
    }
    for (size_t i = 0; i < 3; ++i) {
      set_integer(record + kFieldBricks + i, bricks[i]);
      set_integer(record + kFieldLast + i, l.count[i]);
    }
    set_integer(record + kFieldFirst, static_cast<int32_t>(first));
    return largest;
  }

  /// Sets the majorants of the field whose bricks begin at `first` and have these largest values.
  /// `extinction`: the largest extinction for a value of 1. `least`: of bricks that have anything in them.
  void set_majorants(const std::vector<double>& largest, size_t first, double extinction, bool collides,
                     double brick_length, double least) {
    for (size_t b = 0; b < largest.size(); ++b) {
      const double most = extinction * largest[b];
      if (!(most < kDensest))
        throw bad_grid(medium_, "is opaque within 1e-18 of the scene's extent; lower its \"scale\"");
      // Rounded up: looked-up values may exceed what they lie between by some roundings.
      const auto majorant = static_cast<float>(most > 0 ? std::max(most * (1 + 0x1p-20), least) : 0.0);
      table_.majorants[first + b] =
          !collides || majorant * brick_length > kMostTracked ? -majorant : majorant;
    }
  }

  void set_integer(size_t slot, int32_t value) { table_.records[slot] = std::bit_cast<float>(value); }

 private:
  /// The values of the brick whose first cell is `at`. False if all are 0.
  bool fill(const Lattice& l, const Counts& at, std::vector<float>* block) const {
    if (l.is_absent(at)) return false;
    bool any = false;
    float* out = block->data();
    for (int c = 0; c < l.channels; ++c) {
      for (int z = 0; z < kBrickSide; ++z) {
        for (int y = 0; y < kBrickSide; ++y) {
          for (int x = 0; x < kBrickSide; ++x) {
            const float v = l.value(at[0] + x - 1, at[1] + y - 1, at[2] + z - 1, c);
            any = any || v > 0;
            *out++ = v;
          }
        }
      }
    }
    return any;
  }

  static double largest_of(const std::vector<float>& block, int channels) {
    if (channels != 6) return double{*std::max_element(block.begin(), block.end())};
    double most = 0;
    constexpr size_t kHalf = size_t{3} * kBrickValues;
    for (size_t i = 0; i < kHalf; ++i) most = std::max(most, double{block[i]} + block[kHalf + i]);
    return most;
  }

  const MediumDescription& medium_;
  RenderScene& scene_;
  VolumeTable& table_;
};

/// Length in normalised space of the longest way straight through a brick along an axis.
double brick_length(const Lattice& l, const Transform& medium_to_world, const RenderScene& scene) {
  const double box[3] = {l.hi.x - l.lo.x, l.hi.y - l.lo.y, l.hi.z - l.lo.z};
  double most = 0;
  for (size_t i = 0; i < 3; ++i) {
    const double cell = box[i] / l.count[i];
    const Vec3d edge =
        transform_vector(medium_to_world, {i == 0 ? cell : 0, i == 1 ? cell : 0, i == 2 ? cell : 0});
    most = std::max(most, length(edge));
  }
  return std::ldexp(most * kBrick, scene.scale_exponent);
}

}  // namespace

int32_t add_grid(const MediumDescription& m, const std::vector<Transform>& way, const float* medium,
                 bool collides, int threads, RenderScene* scene) {
  const MediumGrid& grid = *m.grid;
  VolumeTable& table = scene->volumes;
  const size_t record = table.records.size();
  table.records.resize(record + kGridFloats, 0.0f);
  GridBuilder builder(m, scene);

  Lattice l;
  double extinction = 1;
  VolumeField cloud;
  if (grid.cloud) cloud = cloud_field(*grid.cloud, grid.lo, grid.hi, threads);
  if (grid.density || grid.cloud) {
    l = lattice_of(grid.cloud ? cloud : *grid.density);
    extinction = 0;
    for (int c = 0; c < 3; ++c) extinction = std::max(extinction, double{medium[kMediumExtinction + c]});
  } else {
    const VolumeField& some = grid.sigma_a ? *grid.sigma_a : *grid.sigma_s;
    l = lattice_of(some, static_cast<float>(std::ldexp(1.0, -scene->scale_exponent)));
    l.channels = 6;
    l.fields[0] = grid.sigma_a.get(), l.fields[1] = grid.sigma_s.get();
    l.constants[0] = m.sigma_a.r, l.constants[1] = m.sigma_s.r;
  }
  const size_t first = table.bricks.size();
  const std::vector<double> largest = builder.add_field(l, record + kGridCoefficients);
  const double length = brick_length(l, grid.medium_to_world, *scene);
  // What shines is seen at tentative collisions: there is to be about one in a brick, however thin.
  const double least = is_black(brightest(m)) ? 0 : 1 / length;
  builder.set_majorants(largest, first, extinction, collides, length, least);
  builder.set_integer(record + kGridChannels, l.channels);

  const double lo[3] = {grid.lo.x, grid.lo.y, grid.lo.z}, hi[3] = {grid.hi.x, grid.hi.y, grid.hi.z},
               from[3] = {l.lo.x, l.lo.y, l.lo.z}, to[3] = {l.hi.x, l.hi.y, l.hi.z};
  for (size_t i = 0; i < 3; ++i) {
    const auto cell = [&](double x) {
      const double at = (x - from[i]) / (to[i] - from[i]) * l.count[i] + 0.5;
      return static_cast<float>(std::clamp(at, 0.0, l.count[i] + 1.0));
    };
    table.records[record + kGridLo + i] = cell(lo[i]);
    table.records[record + kGridHi + i] = cell(hi[i]);
  }

  int32_t kind = is_black(brightest(m)) ? kNoEmission : kEvenEmission;
  if (kind != kNoEmission && grid.emission) {
    kind = grid.emission->channels == 3 ? kRgbEmission : kScaledEmission;
    builder.add_field(lattice_of(*grid.emission), record + kGridEmission);
  }
  builder.set_integer(record + kGridColors, -1);
  if (kind != kNoEmission && grid.temperature) {
    const std::vector<double> kelvins =
        builder.add_field(lattice_of(*grid.temperature), record + kGridTemperature);
    const double hottest = *std::max_element(kelvins.begin(), kelvins.end());
    builder.set_integer(record + kGridColors, static_cast<int32_t>(table.values.size()));
    table.records[record + kGridColorRate] = static_cast<float>((kGridColorCount - 1) / hottest);
    for (int i = 0; i < kGridColorCount; ++i) {
      const Rgb c = black_body_radiance(hottest * i / (kGridColorCount - 1));
      const float rgb[] = {c.r, c.g, c.b};
      table.values.append(rgb, 3);
    }
  }
  builder.set_integer(record + kGridEmissionKind, kind);
  builder.set_integer(record + kGridLight, -1);  // until volume_lights.h
  const auto pose = static_cast<int32_t>(table.poses.size() / kGridPoseFloats);
  builder.set_integer(record + kGridPose, way.empty() ? -1 : pose);
  builder.set_integer(record + kGridSegments, std::max(static_cast<int32_t>(way.size()) - 1, 0));
  for (const Transform& to : way) {
    const Vec3d p = scene->normalised_point(transform_point(to, scene->origin));
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 3; ++column)
        table.poses.push_back(static_cast<float>(to.m[row][column]));
    }
    table.poses.insert(table.poses.end(),
                       {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  }
  return static_cast<int32_t>(record / kGridFloats);
}

}  // namespace lightmill
