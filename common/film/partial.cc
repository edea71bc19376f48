#include "common/film/partial.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <stdexcept>

#include "common/film/splats/splat_frame.h"

namespace lightmill {

namespace {

constexpr size_t kStripes = 64;

/// The sums of both, ascending by pixel, without zeros.
std::vector<SplatSum> merged(const std::vector<SplatSum>& a, const std::vector<SplatSum>& b) {
  std::vector<SplatSum> sums;
  sums.reserve(std::max(a.size(), b.size()));
  auto x = a.begin(), y = b.begin();
  while (x != a.end() || y != b.end()) {
    if (y == b.end() || (x != a.end() && x->pixel < y->pixel)) {
      sums.push_back(*x++);
    } else if (x == a.end() || y->pixel < x->pixel) {
      sums.push_back(*y++);
    } else {
      sums.push_back(*x++);
      sums.back().sum += y++->sum;
      if (sums.back().sum.is_zero()) sums.pop_back();
    }
  }
  return sums;
}

}  // namespace

RenderCounters& RenderCounters::operator+=(const RenderCounters& o) {
  camera_paths += o.camera_paths;
  light_paths += o.light_paths;
  closest_hit_rays += o.closest_hit_rays;
  shadow_rays += o.shadow_rays;
  zero_connections_skipped += o.zero_connections_skipped;
  rouletted_connections += o.rouletted_connections;
  nonfinite += o.nonfinite;
  return *this;
}

struct PartialBuilder::Impl {
  FilmGrid grid;
  TileSpec tile;
  int quantum_exponent = 0;
  bool has_camera_layer = false, has_splat_layer = false;
  PixelRect rect;  // of the tile

  std::array<std::mutex, kStripes> camera_locks;  // cell -> lock, for all layers of the camera's samples
  std::vector<ExactRgb> camera;
  SplatFrame splats, direct_splats;
  std::vector<SplatFrame> group_splats;  // of all groups, if there are some: they make up `splats`
  std::vector<SplatFrame> lobe_splats;   // of lobe_layers
  std::vector<MatteCell> mattes;
  std::shared_ptr<const MatteList> matte_list;  // guarded by counters_lock
  AovSums aovs;
  std::mutex counters_lock;
  RenderCounters counters;
  Dropped dropped, dropped_splats;
  double cpu_seconds = 0;

  void count_of_splats(const Dropped& of_splats) {
    if (!of_splats.any()) return;
    const std::lock_guard lock(counters_lock);
    counters.nonfinite += of_splats.refused();
    dropped_splats.add(of_splats);
  }
  /// The cell's number in the tile. Throws std::logic_error if it lies outside.
  size_t cell_number(int cx, int cy) const;
  void add_layer(int cx, int cy, std::span<const ExactRgb, kCellPixels> sums, std::vector<ExactRgb>* layer);
};

PartialBuilder::PartialBuilder(const FilmGrid& grid, const TileSpec& tile, int quantum_exponent,
                               bool has_camera_layer, bool has_splat_layer, const AovSpec& aovs)
    : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.grid = grid;
  m.tile = tile;
  m.quantum_exponent = quantum_exponent;
  m.has_camera_layer = has_camera_layer;
  m.has_splat_layer = has_splat_layer;
  m.rect = grid.pixels(tile.cells);
  if (m.rect.empty()) throw std::logic_error("PartialBuilder: the tile lies outside the crop window");
  const auto area = static_cast<size_t>(m.rect.area());
  if (has_camera_layer) m.camera.resize(area);
  if (has_splat_layer) m.splats = SplatFrame(grid, quantum_exponent);
  m.aovs.spec = aovs;
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (has_layer(aovs, layer)) m.aovs.layers[static_cast<size_t>(layer)].resize(area);
  }
  if (has_splat_layer && needs_layer(aovs.set, kDirectLayer)) {
    m.direct_splats = SplatFrame(grid, quantum_exponent);
  }
  m.aovs.groups.resize(group_layers(aovs.groups));
  for (GroupSums& group : m.aovs.groups) {
    group.camera.resize(area);
  }
  for (size_t i = 0; has_splat_layer && !m.aovs.groups.empty() && i < aovs.groups.size(); ++i)
    m.group_splats.emplace_back(grid, quantum_exponent);
  m.aovs.lobes.resize(lobe_layers(aovs.set));
  for (GroupSums& lobe : m.aovs.lobes) {
    lobe.camera.resize(area);
    if (has_splat_layer) m.lobe_splats.emplace_back(grid, quantum_exponent);
  }
  if (aovs.set & kAovsOfCounts) m.mattes.resize(static_cast<size_t>(tile.cells.count()));
}

PartialBuilder::~PartialBuilder() = default;

const AovSpec& PartialBuilder::aovs() const { return impl_->aovs.spec; }

size_t PartialBuilder::Impl::cell_number(int cx, int cy) const {
  const CellRect& cells = tile.cells;
  if (cx < cells.x0 || cx >= cells.x1 || cy < cells.y0 || cy >= cells.y1) {
    throw std::logic_error("PartialBuilder::add_camera: the cell lies outside the tile");
  }
  return static_cast<size_t>((cy - cells.y0) * cells.width() + (cx - cells.x0));
}

void PartialBuilder::Impl::add_layer(int cx, int cy, std::span<const ExactRgb, kCellPixels> sums,
                                     std::vector<ExactRgb>* layer) {
  const size_t cell = cell_number(cx, cy);
  const PixelRect r = grid.pixels({cx, cy, cx + 1, cy + 1});
  const std::lock_guard lock(camera_locks[cell % kStripes]);
  for (int y = r.y0; y < r.y1; ++y) {
    const ExactRgb* from =
        &sums[static_cast<size_t>((y - cy * kCellSize) * kCellSize + r.x0 - cx * kCellSize)];
    ExactRgb* to = &(*layer)[static_cast<size_t>(y - rect.y0) * static_cast<size_t>(rect.width()) +
                             static_cast<size_t>(r.x0 - rect.x0)];
    for (int x = r.x0; x < r.x1; ++x) *to++ += *from++;
  }
}

void PartialBuilder::add_camera(int cx, int cy, std::span<const ExactRgb, kCellPixels> sums) {
  if (!impl_->has_camera_layer) throw std::logic_error("PartialBuilder::add_camera: no camera layer");
  impl_->add_layer(cx, cy, sums, &impl_->camera);
}

void PartialBuilder::add_aov(int layer, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums) {
  if (!has_layer(impl_->aovs.spec, layer)) throw std::logic_error("PartialBuilder::add_aov: no such AOV");
  impl_->add_layer(cx, cy, sums, &impl_->aovs.layers[static_cast<size_t>(layer)]);
}

void PartialBuilder::add_splats(std::span<const Splat> splats) {
  if (!impl_->has_splat_layer) throw std::logic_error("PartialBuilder::add_splats: no splat layer");
  impl_->count_of_splats(impl_->splats.add(splats));
}

void PartialBuilder::add_direct_splats(std::span<const Splat> splats) {
  if (impl_->direct_splats.empty()) throw std::logic_error("PartialBuilder::add_direct_splats: no such AOV");
  impl_->direct_splats.add(splats);  // what it drops was counted by add_splats
}

void PartialBuilder::add_group(size_t group, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums) {
  impl_->add_layer(cx, cy, sums, &impl_->aovs.groups.at(group).camera);
}

void PartialBuilder::add_group_splats(size_t group, std::span<const Splat> splats) {
  impl_->count_of_splats(impl_->group_splats.at(group).add(splats));
}

void PartialBuilder::add_lobe(size_t part, int cx, int cy, std::span<const ExactRgb, kCellPixels> sums) {
  impl_->add_layer(cx, cy, sums, &impl_->aovs.lobes.at(part).camera);
}

void PartialBuilder::add_lobe_splats(size_t part, std::span<const Splat> splats) {
  impl_->lobe_splats.at(part).add(splats);  // what it drops was counted with the whole
}

void PartialBuilder::add_mattes(int cx, int cy, const MatteCell& counts,
                                const std::shared_ptr<const MatteList>& names) {
  if (impl_->mattes.empty()) throw std::logic_error("PartialBuilder::add_mattes: no such AOV");
  const size_t cell = impl_->cell_number(cx, cy);
  {
    const std::lock_guard lock(impl_->camera_locks[cell % kStripes]);
    add_counts(counts, {}, &impl_->mattes[cell]);
  }
  const std::lock_guard lock(impl_->counters_lock);
  impl_->matte_list = names;
}

void PartialBuilder::add_counters(const RenderCounters& counters, double cpu_seconds) {
  const std::lock_guard lock(impl_->counters_lock);
  impl_->counters += counters;
  impl_->cpu_seconds += cpu_seconds;
}

void PartialBuilder::add_dropped(const Dropped& of_camera_paths, const Dropped& of_light_paths) {
  if (!of_camera_paths.any() && !of_light_paths.any()) return;
  const std::lock_guard lock(impl_->counters_lock);
  impl_->dropped.add(of_camera_paths);
  impl_->dropped_splats.add(of_light_paths);
}

Partial PartialBuilder::take() {
  Impl& m = *impl_;
  Partial partial;
  partial.tile = m.tile;
  partial.grid = m.grid;
  partial.quantum_exponent = m.quantum_exponent;
  partial.camera = std::move(m.camera);
  if (m.has_splat_layer) {
    partial.splats = m.splats.take();
    partial.light_paths = m.counters.light_paths;
  }
  partial.aovs = std::move(m.aovs);
  if (!m.direct_splats.empty()) partial.aovs.direct_splats = m.direct_splats.take();
  for (size_t i = 0; i < m.group_splats.size(); ++i) {
    std::vector<SplatSum> sums = m.group_splats[i].take();
    partial.splats = merged(partial.splats, sums);
    if (i < partial.aovs.groups.size()) partial.aovs.groups[i].splats = std::move(sums);
  }
  for (size_t i = 0; i < m.lobe_splats.size(); ++i) partial.aovs.lobes[i].splats = m.lobe_splats[i].take();
  MatteSums mattes;
  mattes.cells = std::move(m.mattes);
  if (m.matte_list) mattes.names = m.matte_list->names;
  if (m.matte_list && partial.aovs.spec.set & kAovsOfIds) mattes.ids = m.matte_list->ids;
  if (!mattes.cells.empty()) partial.mattes = canonical(mattes);
  partial.counters = m.counters;
  partial.dropped = m.dropped;
  // A splat adds to the mean of the image what it has over the number of light paths.
  const auto pixel_samples = static_cast<double>(m.rect.area() * m.tile.samples());
  const auto light_paths = static_cast<double>(std::max(m.counters.light_paths, uint64_t{1}));
  partial.dropped.add(m.dropped_splats, pixel_samples / light_paths);
  partial.cpu_seconds = m.cpu_seconds;
  return partial;
}

}  // namespace lightmill
