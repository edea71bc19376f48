#include "worker/render/guiding/training/distant_emission_training.h"

#include <algorithm>
#include <cmath>

#include "worker/render/light/light_record.h"

namespace lightmill {
namespace {

/// Cells a side, and the part of light paths that start anywhere on the disk.
constexpr int32_t kDiskCells = 64;
constexpr double kUniformShare = 0.2;
/// Most of the disk that may lead to places that were seen.
constexpr double kMostSeen = 0.5;
/// Part of the light paths of lights at infinity that are shared by power.
constexpr double kPowerShare = 0.125;

/// How much is seen through a square's cells.
class SeenCells {
 public:
  SeenCells() : seen_(size_t{kDiskCells} * kDiskCells, 0) {}

  /// A point at (x, y) of [-1, 1]^2, which counts a little for the cells around, too.
  void add(float x, float y) {
    const int32_t column = square_cell(x, kDiskCells), row = square_cell(y, kDiskCells);
    for (int32_t dy = -1; dy <= 1; ++dy) {
      for (int32_t dx = -1; dx <= 1; ++dx) {
        const int32_t c = column + dx, r = row + dy;
        if (c < 0 || c >= kDiskCells || r < 0 || r >= kDiskCells) continue;
        seen_[static_cast<size_t>(r * kDiskCells + c)] += dx == 0 && dy == 0 ? 1 : 0.25;
      }
    }
  }

  /// Weights of the cells: the root of how often each was seen, and kUniformShare evenly; empty if too much
  /// is seen.
  std::vector<double> weights() const {
    const auto on_disk = [](size_t i) {
      const size_t column = i % kDiskCells, row = i / kDiskCells;
      const double x = (static_cast<double>(column) + 0.5) * 2 / kDiskCells - 1,
                   y = (static_cast<double>(row) + 0.5) * 2 / kDiskCells - 1;
      return x * x + y * y < (1 + 2.0 / kDiskCells) * (1 + 2.0 / kDiskCells);
    };
    double total = 0, disk = 0, seen = 0;
    for (size_t i = 0; i < seen_.size(); ++i) {
      total += std::sqrt(seen_[i]);
      disk += on_disk(i);
      seen += seen_[i] > 0;
    }
    if (!(seen > 0) || seen > kMostSeen * disk) return {};
    std::vector<double> w(seen_.size());
    for (size_t i = 0; i < w.size(); ++i)
      w[i] = (1 - kUniformShare) * std::sqrt(seen_[i]) / total + (on_disk(i) ? kUniformShare / disk : 0);
    return w;
  }

 private:
  std::vector<double> seen_;
};

}  // namespace

void train_distant_emission(const std::vector<LitPlace>& places, const std::vector<NextEventProbe>& trials,
                            LightTable* lights) {
  for (int32_t i = 0; i < lights->count(); ++i) {
    if (lights->type[static_cast<size_t>(i)] != kDistantLight) continue;
    const LightRecord<float> r(*lights, i);
    const Frame<float> frame(r.vec(kLightN));
    SeenCells seen;
    for (const NextEventProbe& t : trials) {
      if (t.channel != static_cast<uint32_t>(i) || !(t.square > 0)) continue;
      const Vec3f& p = places[t.place].p;
      const Vec3<float> d = (Vec3<float>{p.x, p.y, p.z} - r.vec(kLightP)) * (1 / r.scalar(3));
      seen.add(dot(d, frame.s), dot(d, frame.t));
    }
    const std::vector<double> weights = seen.weights();
    if (weights.empty()) continue;
    lights->emission_cells.emplace_back(weights).add_table();
    lights->records[static_cast<size_t>(i) * kLightFloats + 7] =
        static_cast<float>(lights->emission_cells.size());
  }
}

void share_far_paths(const NextEventProbes& rays, const std::vector<NextEventProbe>& trials,
                     const std::vector<int32_t>& sky_light, LightTable* lights) {
  std::vector<double> irradiance(rays.channels(), 0), count(rays.channels(), 0);
  for (const NextEventProbe& t : trials) {
    irradiance[t.channel] += std::sqrt(double{t.square});
    ++count[t.channel];
  }
  for (size_t i = 0; i < count.size(); ++i) irradiance[i] /= std::max(count[i], 1.0);
  LightMoments sums = rays.moments(irradiance);
  for (size_t k = 0; k < sums.sky.size(); ++k) {
    for (const double bin : sums.sky[k]) sums.light[static_cast<size_t>(sky_light[k])] += bin;
  }
  const auto far = [&](size_t i) {
    return lights->type[i] == kDistantLight || lights->type[i] == kInfiniteLight;
  };
  std::vector<double> weights;
  double paths = 0, all = 0;
  for (size_t i = 0; i < sums.light.size(); ++i) {
    weights.push_back(double{lights->records[i * kLightFloats + kLightSelect]});
    if (far(i)) paths += weights[i], all += sums.light[i];
  }
  if (!(all > 0)) return;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (far(i)) weights[i] = kPowerShare * weights[i] + (1 - kPowerShare) * paths * sums.light[i] / all;
  }
  lights->choose_emitters_by(weights);
}

}  // namespace lightmill
