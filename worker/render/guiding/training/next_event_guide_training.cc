#include "worker/render/guiding/training/next_event_guide_training.h"

#include <algorithm>
#include <array>

#include "worker/render/guiding/training/distant_emission_training.h"
#include "worker/render/guiding/training/next_event_probes.h"

namespace lightmill {
namespace {

/// About this many camera paths are followed, to this depth.
constexpr int64_t kTrainingPaths = int64_t{1} << 15;
constexpr int kDepth = 4;
/// Seed of random numbers that are not those of the image.
constexpr uint64_t kNextEventSeed = 0x6c616d7073;
/// Cells along the longest side of what is visible.
constexpr int kCells = 16;
/// A coarser cell counts as much as this many rays.
constexpr double kPrior = 4;
/// Bounds of what is learnt per cell and of what the guide must gain.
constexpr size_t kMostChannels = 2048;
constexpr double kLeastNextEventGain = 1.1;

/// Sums over the cells of a grid, or of one whose cells are 2^k of its cells a side.
class Level {
 public:
  Level(const LightGrid& grid, int k, size_t channels) : grid_(grid), k_(k), channels_(channels) {
    for (size_t axis = 0; axis < 3; ++axis) cells_[axis] = ((grid.cells[axis] - 1) >> k) + 1;
    const auto n = static_cast<size_t>(count());
    tried.assign(n * channels, 0);
    sum.assign(n * channels, 0);
    places.assign(n, 0);
  }
  int32_t count() const { return cells_[0] * cells_[1] * cells_[2]; }
  /// The cell that holds cell `fine` of the grid.
  size_t cell(int32_t fine) const {
    const int32_t x = fine % grid_.cells[0], y = fine / grid_.cells[0] % grid_.cells[1],
                  z = fine / grid_.cells[0] / grid_.cells[1];
    return static_cast<size_t>(((z >> k_) * cells_[1] + (y >> k_)) * cells_[0] + (x >> k_));
  }
  void add(int32_t fine, const NextEventProbe& t) {
    const size_t i = cell(fine) * channels_ + t.channel;
    ++tried[i];
    sum[i] += t.square;
  }

  std::vector<float> tried;  // per cell and channel
  std::vector<double> sum;
  std::vector<int64_t> places;  // per cell

 private:
  const LightGrid& grid_;
  int k_;
  size_t channels_;
  std::array<int32_t, 3> cells_{};
};

/// Gives images to even skies, so that they have directions to choose from. Returns these lights.
std::vector<int32_t> give_images(LightTable* lights) {
  std::vector<int32_t> changed;
  for (const int32_t i : lights->infinite) {
    float* const r = &lights->records[static_cast<size_t>(i) * kLightFloats];
    if (r[4] != kEvenSky) continue;
    constexpr int32_t kSide = BinnedDensity::kMostBins;
    r[4] = static_cast<float>(lights->environments.size());
    lights->environments.emplace_back(
        LightImage{"", kSide, kSide, std::vector<float>(3 * size_t{kSide} * kSide, 1.0f)},
        Rgb{r[kLightRadiance], r[kLightRadiance + 1], r[kLightRadiance + 2]}, Transform{});
    changed.push_back(i);
  }
  return changed;
}

/// Undoes all of that.
void leave_out(const std::vector<int32_t>& changed, LightTable* lights) {
  for (const int32_t i : changed) {
    lights->records[static_cast<size_t>(i) * kLightFloats + 4] = kEvenSky;
    lights->environments.pop_back();
  }
  for (EnvironmentMap& map : lights->environments) map.bins = {};
  const double gain = lights->guide.gain;
  lights->guide = {};
  lights->guide.gain = gain;
}

/// Number of the light of each environment map that is to have bins, else -1.
std::vector<int32_t> make_bins(LightTable* lights) {
  std::vector<int32_t> sky_light(lights->environments.size(), -1);
  for (const int32_t i : lights->infinite) {
    const float* const r = &lights->records[static_cast<size_t>(i) * kLightFloats];
    if (r[4] < 0 || r[6] > 0) continue;  // a sun, or behind a portal, which is a guide of its own
    const auto k = static_cast<size_t>(r[4]);
    lights->environments[k].bins = BinnedDensity(lights->environments[k].weights());
    sky_light[k] = i;
  }
  return sky_light;
}

/// The tables of all cells, from the trials of `places`.
GuidedSquares make_tables(const NextEventProbes& rays, const std::vector<LitPlace>& places,
                          const std::vector<NextEventProbe>& trials, const std::vector<int32_t>& sky_light,
                          LightTable* lights) {
  std::vector<Vec3f> points;
  points.reserve(places.size());
  for (const LitPlace& p : places) points.push_back(p.p);
  const LightGrid grid = place_grid(points, kCells);
  std::vector<int32_t> cell_of;
  cell_of.reserve(points.size());
  for (const Vec3f& p : points) cell_of.push_back(grid.at<float>({p.x, p.y, p.z}));
  const size_t channels = rays.channels();
  std::vector<Level> levels;
  do {
    levels.emplace_back(grid, static_cast<int>(levels.size()), channels);
  } while (levels.back().count() > 1);
  for (Level& level : levels) {
    for (const int32_t cell : cell_of) ++level.places[level.cell(cell)];
    for (const NextEventProbe& t : trials) level.add(cell_of[t.place], t);
  }
  // A cell in which nothing was seen takes the first around it in which something was.
  std::vector<std::vector<int32_t>> number(levels.size());
  for (size_t k = 0; k < levels.size(); ++k) number[k].assign(static_cast<size_t>(levels[k].count()), -1);
  std::vector<LightMoments> tables;
  std::vector<int32_t> table_of(static_cast<size_t>(grid.count()));
  for (int32_t cell = 0; cell < grid.count(); ++cell) {
    size_t own = 0;
    while (levels[own].places[levels[own].cell(cell)] == 0) ++own;
    int32_t& table = number[own][levels[own].cell(cell)];
    if (table < 0) {
      table = static_cast<int32_t>(tables.size());
      std::vector<double> squares(channels, 0);
      for (size_t k = levels.size(); k-- > own;) {
        const size_t first = levels[k].cell(cell) * channels;
        for (size_t c = 0; c < channels; ++c) {
          const double n = double{levels[k].tried[first + c]}, prior = k + 1 < levels.size() ? kPrior : 0;
          if (n + prior > 0) squares[c] = (levels[k].sum[first + c] + prior * squares[c]) / (n + prior);
        }
      }
      tables.push_back(rays.moments(squares));
      // Nothing is seen in cells without a table of their own.
      tables.back().weight = own == 0 ? static_cast<double>(levels[0].places[levels[0].cell(cell)]) : 0;
    }
    table_of[static_cast<size_t>(cell)] = table;
  }
  return guide_lights(grid, table_of, tables, sky_light, lights);
}

}  // namespace

void train_next_event_guide(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width,
                            int height, int threads, RenderScene* scene) {
  LightTable& lights = scene->lights;
  // The rays of its training do not end in media, as those to grids that shine do.
  if (!(lights.any_infinite() || lights.unequal) || !lights.volumes.empty() || scene->any_fibres ||
      scene->any_bodies)
    return;
  const std::vector<int32_t> changed = give_images(&lights);
  const std::vector<int32_t> sky_light = make_bins(&lights);
  StageContext context{*scene, accel, camera, filter, {width, height, {0, 0, width, height}}};
  const NextEventProbes rays(context, sky_light);
  const bool skies = std::any_of(sky_light.begin(), sky_light.end(), [](int32_t i) { return i >= 0; });
  if ((!rays.draws_lights() && !skies) || rays.channels() > kMostChannels) return leave_out(changed, &lights);
  context.seed = kNextEventSeed;
  context.strategies = kNextEvent;
  context.max_depth = kDepth;
  const std::vector<LitPlace> places = find_places(context, kTrainingPaths, kDepth, threads);
  if (places.empty()) return leave_out(changed, &lights);
  const std::vector<NextEventProbe> trials = rays.run(places, kNextEventSeed, threads);
  const GuidedSquares squares = make_tables(rays, places, trials, sky_light, &lights);
  const double before = squares.skies_before + rays.unguided_square(trials, places.size());
  if (squares.after > 0) lights.guide.gain = before / squares.after;
  if (lights.guide.gain < kLeastNextEventGain) {
    leave_out(changed, &lights);
  } else if (lights.guide.chooses()) {
    share_far_paths(rays, trials, sky_light, &lights);
  }
  train_distant_emission(places, trials, &lights);
}

}  // namespace lightmill
