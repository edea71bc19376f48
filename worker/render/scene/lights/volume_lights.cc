#include "worker/render/scene/lights/volume_lights.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "common/base/parallel.h"
#include "common/scene/transform.h"
#include "worker/render/light/alias_table.h"
#include "worker/render/scene/media/grid_lanes.h"

namespace lightmill {
namespace {

using F = Float8;

/// Part of the choices that all bricks that shine share evenly: what is between them may hide the brightest.
constexpr double kEvenPart = 1.0 / 16;
/// Points of a brick along each axis at which its emission is looked up.
constexpr int kPoints = 4;

/// What a brick sends out.
struct Brick {
  std::array<int32_t, 3> at{};
  size_t number = 0;   // in VolumeTable::bricks
  double volume = 0;   // of normalised space, within the grid's box
  double rgb[3] = {};  // mean radiance per unit length
  double rate = 0;     // mean extinction
};

class GridLight {
 public:
  GridLight(int32_t medium, size_t grid, const RenderScene& scene)
      : scene_(scene), medium_(medium), record_(scene.volumes.records.data() + grid * kGridFloats) {
    Transform to_cells;
    const float* const map = record_ + kGridCoefficients + kFieldMap;
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 4; ++column) to_cells.m[row][column] = double{map[4 * row + column]};
    }
    from_cells_ = inverse(to_cells);
    cell_volume_ = std::fabs(determinant3(from_cells_));
  }

  std::vector<Brick> find_bricks(int threads) const {
    std::vector<Brick> bricks;
    const auto count = [&](size_t i) { return integer(kGridCoefficients + kFieldBricks + i); };
    auto number = static_cast<size_t>(integer(kGridCoefficients + kFieldFirst));
    for (int32_t z = 0; z < count(2); ++z) {
      for (int32_t y = 0; y < count(1); ++y) {
        for (int32_t x = 0; x < count(0); ++x, ++number) {
          if (scene_.volumes.majorants[number] == 0) continue;
          Brick b;
          b.at = {x, y, z};
          b.number = number;
          b.volume = cell_volume_;
          for (size_t i = 0; i < 3; ++i) {
            const BrickSide side(record_, i, b.at[i]);
            b.volume *= double{side.until} - double{side.from};
          }
          if (b.volume > 0) bricks.push_back(b);
        }
      }
    }
    constexpr size_t kChunk = 256;
    parallel_for((bricks.size() + kChunk - 1) / kChunk, threads, [&](size_t chunk) {
      for (size_t i = chunk * kChunk; i < std::min((chunk + 1) * kChunk, bricks.size()); ++i)
        look_at(&bricks[i]);
    });
    std::erase_if(bricks, [](const Brick& b) { return !(b.rgb[0] + b.rgb[1] + b.rgb[2] > 0); });
    return bricks;
  }

  /// W that leaves the brick, mean over the channels: 4 pi times its emission, less what is absorbed on the
  /// way out of a brick of this volume, roughly.
  static double power(const Brick& b) {
    const double mean = (b.rgb[0] + b.rgb[1] + b.rgb[2]) / 3;
    return 4 * M_PI * mean * b.volume / (1 + b.rate * std::cbrt(b.volume));
  }

  /// The light's record, with a box around `bricks`, which it also gives `light`.
  std::array<float, kLightFloats> record(const std::vector<Brick>& bricks, VolumeLight* light) const {
    double lo[3] = {1e9, 1e9, 1e9}, hi[3] = {};
    for (const Brick& b : bricks) {
      for (size_t i = 0; i < 3; ++i) {
        const BrickSide side(record_, i, b.at[i]);
        lo[i] = std::min(lo[i], double{side.from});
        hi[i] = std::max(hi[i], double{side.until});
      }
    }
    std::array<float, kLightFloats> r{};
    const Vec3d corner = transform_point(from_cells_, {lo[0], lo[1], lo[2]});
    put(corner, kLightP, &r);
    double diagonal2 = 0;
    constexpr size_t kEdges[] = {kLightE1, kLightE2, kLightN};
    for (size_t i = 0; i < 3; ++i) {
      light->first[i] = static_cast<float>(lo[i]);
      light->cells[i] = static_cast<float>(hi[i] - lo[i]);
      const double size = hi[i] - lo[i];
      const Vec3d edge =
          transform_vector(from_cells_, {i == 0 ? size : 0, i == 1 ? size : 0, i == 2 ? size : 0});
      put(edge, kEdges[i], &r);
      diagonal2 += length(edge) * length(edge);
    }
    // The brightest that is seen: of thick parts emission over extinction, of thin ones a way through all.
    for (const Brick& b : bricks) {
      const double seen = std::min(1 / b.rate, std::sqrt(diagonal2));
      for (size_t c = 0; c < 3; ++c)
        r[kLightRadiance + c] = std::max(r[kLightRadiance + c], static_cast<float>(b.rgb[c] * seen));
    }
    r[kLightArea] = 1;  // not used
    return r;
  }

  /// The steps of a grid that moves (LightTable::set_moving): where its poses take the box. Empty if it
  /// stands.
  std::vector<float> steps(const std::array<float, kLightFloats>& box) const {
    std::vector<float> out;
    const int32_t first = integer(kGridPose);
    for (int32_t i = 0; first >= 0 && i <= integer(kGridSegments); ++i) {
      const float* const pose =
          &scene_.volumes.poses[static_cast<size_t>(first + i) * static_cast<size_t>(kGridPoseFloats)];
      for (const size_t slot : {size_t{kLightP}, size_t{kLightE1}, size_t{kLightE2}, size_t{kLightN}}) {
        for (size_t row = 0; row < 3; ++row) {
          double x = slot == kLightP ? double{pose[9 + row]} : 0.0;
          for (size_t c = 0; c < 3; ++c) x += double{pose[3 * row + c]} * double{box[slot + c]};
          out.push_back(static_cast<float>(x));
        }
      }
    }
    return out;
  }

 private:
  int32_t integer(size_t slot) const { return std::bit_cast<int32_t>(record_[slot]); }
  static void put(const Vec3d& v, size_t slot, std::array<float, kLightFloats>* r) {
    (*r)[slot] = static_cast<float>(v.x), (*r)[slot + 1] = static_cast<float>(v.y),
    (*r)[slot + 2] = static_cast<float>(v.z);
  }

  /// Looks up what shines at points that are spread evenly over the brick.
  void look_at(Brick* b) const {
    const MaskOf<F> all = splat_mask<F>(true);
    const Grids<F> grids(scene_, splat_int<F>(medium_), all);
    constexpr int kAll = kPoints * kPoints * kPoints;
    static_assert(kAll % kWidth<F> == 0);
    for (int first = 0; first < kAll; first += kWidth<F>) {
      float at[3][kWidth<F>], place[3][kWidth<F>];
      int32_t cell[3][kWidth<F>];
      for (int l = 0; l < kWidth<F>; ++l) {
        double p[3];
        for (size_t i = 0; i < 3; ++i) {
          const BrickSide side(record_, i, b->at[i]);
          const int k = (first + l) >> (2 * i) & (kPoints - 1);
          p[i] = double{side.from} + (double{side.until} - double{side.from}) * (k + 0.5) / kPoints;
          at[i][l] = static_cast<float>(p[i]);
          cell[i][l] = std::clamp(static_cast<int32_t>(p[i]), side.first_cell, side.last_cell);
        }
        const Vec3d n = transform_point(from_cells_, {p[0], p[1], p[2]});
        place[0][l] = static_cast<float>(n.x), place[1][l] = static_cast<float>(n.y),
        place[2][l] = static_cast<float>(n.z);
      }
      const auto lanes = [](const float(*rows)[kWidth<F>]) {
        return Vec3<F>{load<F>(rows[0]), load<F>(rows[1]), load<F>(rows[2])};
      };
      const auto k = grids.at(field_cell<F>(bricks_of(grids.field()), load_int<F>(cell[0]),
                                            load_int<F>(cell[1]), load_int<F>(cell[2]), lanes(at)));
      const Vec3<F> shown = grids.emission(k, lanes(place), all);
      for (int l = 0; l < kWidth<F>; ++l) {
        b->rgb[0] += double{lane(shown.x, l)} / kAll;
        b->rgb[1] += double{lane(shown.y, l)} / kAll;
        b->rgb[2] += double{lane(shown.z, l)} / kAll;
        b->rate += (double{lane(k.extinction.x, l)} + double{lane(k.extinction.y, l)} +
                    double{lane(k.extinction.z, l)}) /
                   (3 * kAll);
      }
    }
  }

  const RenderScene& scene_;
  int32_t medium_;
  const float* record_;  // of the grid
  Transform from_cells_;
  double cell_volume_ = 0;  // of normalised space
};

}  // namespace

void add_volume_lights(int threads, RenderScene* scene) {
  static_assert(kPoints == 4);  // look_at
  LightTable& lights = scene->lights;
  VolumeTable& volumes = scene->volumes;
  for (int32_t medium = 1; medium <= static_cast<int32_t>(scene->medium_count()); ++medium) {
    const int32_t grid =
        std::bit_cast<int32_t>(scene->media[static_cast<size_t>(medium) * kMediumFloats + kMediumGrid]) - 1;
    if (grid < 0) continue;
    float* const record = volumes.records.data() + static_cast<size_t>(grid) * kGridFloats;
    if (std::bit_cast<int32_t>(record[kGridEmissionKind]) == kNoEmission) continue;
    const GridLight source(medium, static_cast<size_t>(grid), *scene);
    const std::vector<Brick> bricks = source.find_bricks(threads);
    double power = 0;
    std::vector<double> weights;
    for (const Brick& b : bricks) power += GridLight::power(b);
    if (!(power > 0) || !std::isfinite(power)) continue;
    VolumeLight& light = lights.volumes.emplace_back();
    light.light = lights.count();
    light.medium = medium;
    for (const Brick& b : bricks) {
      light.bricks.push_back(b.at);
      weights.push_back((1 - kEvenPart) * GridLight::power(b) / power +
                        kEvenPart / static_cast<double>(bricks.size()));
    }
    const std::vector<double> chosen = build_alias_table(weights, &light.keep, &light.alias);
    volumes.drawn.resize(volumes.bricks.size(), 0.0f);
    for (size_t i = 0; i < bricks.size(); ++i)
      volumes.drawn[bricks[i].number] = static_cast<float>(chosen[i] / bricks[i].volume);
    record[kGridLight] = std::bit_cast<float>(light.light);
    const std::array<float, kLightFloats> box = source.record(bricks, &light);
    lights.add(kVolumeLight, box, power);
    if (!scene->medium_groups.empty()) lights.join_group(scene->medium_groups[static_cast<size_t>(medium)]);
    if (const std::vector<float> steps = source.steps(box); !steps.empty())
      lights.set_moving(light.light, steps);
    lights.media.resize(static_cast<size_t>(lights.count()), medium_sides(medium, medium));
  }
}

}  // namespace lightmill
