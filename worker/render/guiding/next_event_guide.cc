#include "worker/render/guiding/next_event_guide.h"

#include <algorithm>
#include <cmath>

#include "worker/render/light/light_table.h"

namespace lightmill {
namespace {

/// Part of a table that stays as without a guide: what hides a light may end within a cell.
constexpr double kUnguided = 0.1;
/// Part of the points that may lie outside of the grid at either end of an axis.
constexpr double kOutside = 0.005;

/// The draw of least mean square: in proportion to the root of each mean square, but for kUnguided.
std::vector<double> best_draw(const std::vector<double>& squares, const std::vector<double>& unguided) {
  double total = 0, rest = 0;
  for (const double m : squares) total += std::sqrt(m);
  for (const double w : unguided) rest += w;
  std::vector<double> p(squares.size());
  for (size_t i = 0; i < p.size(); ++i) {
    const double base = rest > 0 ? unguided[i] / rest : 0;
    p[i] = total > 0 ? (1 - kUnguided) * std::sqrt(squares[i]) / total + kUnguided * base : base;
  }
  return p;
}

/// Mean square of a draw by `weights`.
double mean_square(const std::vector<double>& squares, const std::vector<double>& weights) {
  double total = 0, sum = 0;
  for (const double w : weights) total += w;
  for (size_t i = 0; i < squares.size(); ++i) {
    if (squares[i] > 0 && weights[i] > 0) sum += squares[i] * total / weights[i];
  }
  return sum;
}

struct Axis {
  float origin, extent;
};

Axis span_of(std::vector<float> x) {
  const auto out = static_cast<ptrdiff_t>(kOutside * static_cast<double>(x.size() - 1));
  const auto low = x.begin() + out, high = x.end() - 1 - out;
  std::nth_element(x.begin(), low, x.end());
  const float first = *low;
  std::nth_element(x.begin(), high, x.end());
  return {first, *high - first};
}

/// Number of points next to a border.
int64_t near_borders(const std::vector<float>& x, float origin, float per_unit) {
  int64_t near = 0;
  for (const float v : x) {
    const float place = (v - origin) * per_unit;
    near += std::fabs(place - std::round(place)) < 0x1p-10f;
  }
  return near;
}

}  // namespace

LightGrid place_grid(const std::vector<Vec3f>& points, int most) {
  LightGrid grid;
  if (points.empty()) return grid;
  std::array<std::vector<float>, 3> x;
  for (const Vec3f& p : points) x[0].push_back(p.x), x[1].push_back(p.y), x[2].push_back(p.z);
  std::array<Axis, 3> axes{};
  float longest = 0;
  for (size_t k = 0; k < 3; ++k) {
    axes[k] = span_of(x[k]);
    longest = std::max(longest, axes[k].extent);
  }
  const float size = longest / static_cast<float>(most);
  if (!(size > 0)) return grid;
  for (size_t k = 0; k < 3; ++k) {
    grid.per_unit[k] = 1 / size;
    // One more, as the first begins before the points do.
    grid.cells[k] = static_cast<int32_t>(std::ceil(axes[k].extent / size)) + 1;
    constexpr int kTries = 8;
    int64_t fewest = -1;
    for (int i = 0; i < kTries; ++i) {
      const float origin = axes[k].origin - size * (0.0532f + 0.1171f * static_cast<float>(i));
      const int64_t near = near_borders(x[k], origin, grid.per_unit[k]);
      if (fewest >= 0 && near >= fewest) continue;
      fewest = near;
      grid.origin[k] = origin;
    }
  }
  return grid;
}

GuidedSquares guide_lights(const LightGrid& grid, const std::vector<int32_t>& table_of,
                           const std::vector<LightMoments>& tables, const std::vector<int32_t>& sky_light,
                           LightTable* lights) {
  NextEventGuide& guide = lights->guide;
  guide.grid = grid;
  guide.table_of = table_of;
  guide.lights = lights->count() > 1 && lights->count() <= kGuidedLights ? lights->count() : 0;
  const auto slot = [&](size_t light, int k) {
    return double{lights->records[light * kLightFloats + static_cast<size_t>(k)]};
  };
  std::vector<double> by_power;
  for (size_t i = 0; i < static_cast<size_t>(lights->count()); ++i) by_power.push_back(slot(i, kLightSelect));
  GuidedSquares sum;
  double points = 0;
  for (const LightMoments& table : tables) {
    points += table.weight;
    std::vector<double> guided = table.light;
    for (size_t k = 0; k < table.sky.size(); ++k) {
      if (table.sky[k].empty()) continue;
      BinnedDensity& bins = lights->environments[k].bins;
      const std::vector<double> p = best_draw(table.sky[k], bins.weight);
      bins.add_table(p);
      const auto light = static_cast<size_t>(sky_light[k]);
      const double chosen = slot(light, kLightDirectSelect);
      sum.skies_before += table.weight * mean_square(table.sky[k], bins.weight) / chosen;
      guided[light] = mean_square(table.sky[k], p);
      if (!guide.chooses()) sum.after += table.weight * guided[light] / chosen;
    }
    if (!guide.chooses()) continue;
    const std::vector<double> p = best_draw(guided, by_power);
    sum.after += table.weight * mean_square(guided, p);
    std::vector<float> keep;
    std::vector<int32_t> alias;
    for (const double x : build_alias_table(p, &keep, &alias))
      guide.probability.push_back(static_cast<float>(x));
    guide.keep.insert(guide.keep.end(), keep.begin(), keep.end());
    guide.alias.insert(guide.alias.end(), alias.begin(), alias.end());
  }
  return {sum.skies_before / points, sum.after / points};
}

}  // namespace lightmill
