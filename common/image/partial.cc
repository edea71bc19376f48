#include "common/image/partial.h"

#include <array>
#include <mutex>
#include <stdexcept>

namespace lightmill {

namespace {

constexpr size_t kStripes = 64;

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

// The splat frame is cut into pages, one per cell of the crop window, which are made when the first splat
// arrives. A packet's splats are sorted by page first: one lock per page and packet instead of one per
// splat, and the additions stay in the cache.
struct PartialBuilder::Impl {
  using Page = std::array<ExactRgb, kCellPixels>;

  FilmGrid grid;
  TileSpec tile;
  int quantum_exponent = 0;
  bool has_camera_layer = false, has_splat_layer = false;
  CellRect frame_cells;  // of the crop window
  PixelRect rect;        // of the tile

  std::array<std::mutex, kStripes> camera_locks;  // cell -> lock
  std::vector<ExactRgb> camera;
  std::array<std::mutex, kStripes> page_locks;  // page -> lock
  std::vector<std::unique_ptr<Page>> pages;
  std::mutex counters_lock;
  RenderCounters counters;
  double cpu_seconds = 0;

  std::vector<Partial::SplatSum> collect_splats() const;
};

PartialBuilder::PartialBuilder(const FilmGrid& grid, const TileSpec& tile, int quantum_exponent,
                               bool has_camera_layer, bool has_splat_layer)
    : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.grid = grid;
  m.tile = tile;
  m.quantum_exponent = quantum_exponent;
  m.has_camera_layer = has_camera_layer;
  m.has_splat_layer = has_splat_layer;
  m.frame_cells = grid.cells();
  m.rect = grid.pixels(tile.cells);
  if (m.rect.empty()) throw std::logic_error("PartialBuilder: the tile lies outside the crop window");
  if (has_camera_layer) m.camera.resize(static_cast<size_t>(m.rect.area()));
  if (has_splat_layer) m.pages.resize(static_cast<size_t>(m.frame_cells.count()));
}

PartialBuilder::~PartialBuilder() = default;

void PartialBuilder::add_camera(int cx, int cy, std::span<const ExactRgb, kCellPixels> sums) {
  Impl& m = *impl_;
  const CellRect& cells = m.tile.cells;
  if (!m.has_camera_layer) throw std::logic_error("PartialBuilder::add_camera: no camera layer");
  if (cx < cells.x0 || cx >= cells.x1 || cy < cells.y0 || cy >= cells.y1) {
    throw std::logic_error("PartialBuilder::add_camera: the cell lies outside the tile");
  }
  const PixelRect r = m.grid.pixels({cx, cy, cx + 1, cy + 1});
  const auto cell = static_cast<size_t>((cy - cells.y0) * cells.width() + (cx - cells.x0));
  const std::lock_guard lock(m.camera_locks[cell % kStripes]);
  for (int y = r.y0; y < r.y1; ++y) {
    const ExactRgb* from =
        &sums[static_cast<size_t>((y - cy * kCellSize) * kCellSize + r.x0 - cx * kCellSize)];
    ExactRgb* to = &m.camera[static_cast<size_t>(y - m.rect.y0) * static_cast<size_t>(m.rect.width()) +
                             static_cast<size_t>(r.x0 - m.rect.x0)];
    for (int x = r.x0; x < r.x1; ++x) *to++ += *from++;
  }
}

void PartialBuilder::add_splats(std::span<const Splat> splats) {
  Impl& m = *impl_;
  if (!m.has_splat_layer) throw std::logic_error("PartialBuilder::add_splats: no splat layer");
  const auto width = static_cast<uint32_t>(m.grid.width);
  const auto frame_width = static_cast<uint32_t>(m.frame_cells.width());
  const PixelRect& crop = m.grid.crop;

  // Counting sort by page. A key is page * kCellPixels + pixel within the page; kOutside is dropped.
  constexpr uint64_t kOutside = ~uint64_t{0};
  std::vector<uint64_t> keys(splats.size());
  std::vector<uint32_t> begin(m.pages.size() + 1, 0);
  for (size_t i = 0; i < splats.size(); ++i) {
    const uint32_t pixel = splats[i].pixel;
    const auto y = static_cast<int>(pixel / width);
    const auto x = static_cast<int>(pixel % width);
    if (x < crop.x0 || x >= crop.x1 || y < crop.y0 || y >= crop.y1) {
      keys[i] = kOutside;
      continue;
    }
    const auto ux = static_cast<uint32_t>(x - m.frame_cells.x0 * kCellSize);
    const auto uy = static_cast<uint32_t>(y - m.frame_cells.y0 * kCellSize);
    const uint64_t page = uint64_t{uy / kCellSize} * frame_width + ux / kCellSize;
    keys[i] = page * kCellPixels + (uy % kCellSize) * kCellSize + ux % kCellSize;
    ++begin[page + 1];
  }
  for (size_t p = 1; p < begin.size(); ++p) begin[p] += begin[p - 1];
  std::vector<uint32_t> order(begin.back());
  std::vector<uint32_t> cursor(begin.begin(), begin.end() - 1);
  for (size_t i = 0; i < splats.size(); ++i) {
    if (keys[i] != kOutside) order[cursor[keys[i] / kCellPixels]++] = static_cast<uint32_t>(i);
  }

  uint64_t nonfinite = 0;
  for (size_t p = 0; p < m.pages.size(); ++p) {
    if (begin[p] == begin[p + 1]) continue;
    const std::lock_guard lock(m.page_locks[p % kStripes]);
    if (!m.pages[p]) m.pages[p] = std::make_unique<Impl::Page>();
    Impl::Page& page = *m.pages[p];
    for (uint32_t k = begin[p]; k < begin[p + 1]; ++k) {
      const Splat& splat = splats[order[k]];
      const auto r = to_units(splat.r, m.quantum_exponent);
      const auto g = to_units(splat.g, m.quantum_exponent);
      const auto b = to_units(splat.b, m.quantum_exponent);
      if (!r || !g || !b) {
        ++nonfinite;
        continue;
      }
      ExactRgb& sum = page[keys[order[k]] % kCellPixels];
      sum.c[0] += *r;
      sum.c[1] += *g;
      sum.c[2] += *b;
    }
  }
  if (nonfinite > 0) {
    RenderCounters dropped;
    dropped.nonfinite = nonfinite;
    add_counters(dropped, 0);
  }
}

void PartialBuilder::add_counters(const RenderCounters& counters, double cpu_seconds) {
  const std::lock_guard lock(impl_->counters_lock);
  impl_->counters += counters;
  impl_->cpu_seconds += cpu_seconds;
}

std::vector<Partial::SplatSum> PartialBuilder::Impl::collect_splats() const {
  size_t count = 0;
  for (const auto& page : pages) {
    if (!page) continue;
    for (const ExactRgb& sum : *page) count += !sum.is_zero();
  }
  std::vector<Partial::SplatSum> splats;
  splats.reserve(count);
  for (int cy = frame_cells.y0; cy < frame_cells.y1; ++cy) {
    for (int y = 0; y < kCellSize; ++y) {
      for (int cx = frame_cells.x0; cx < frame_cells.x1; ++cx) {
        const auto index =
            static_cast<size_t>(cy - frame_cells.y0) * static_cast<size_t>(frame_cells.width()) +
            static_cast<size_t>(cx - frame_cells.x0);
        if (!pages[index]) continue;
        const auto row = static_cast<uint32_t>(cy * kCellSize + y) * static_cast<uint32_t>(grid.width);
        for (int x = 0; x < kCellSize; ++x) {
          const ExactRgb& sum = (*pages[index])[static_cast<size_t>(y * kCellSize + x)];
          if (!sum.is_zero()) splats.push_back({row + static_cast<uint32_t>(cx * kCellSize + x), sum});
        }
      }
    }
  }
  return splats;
}

Partial PartialBuilder::take() {
  Impl& m = *impl_;
  Partial partial;
  partial.tile = m.tile;
  partial.grid = m.grid;
  partial.quantum_exponent = m.quantum_exponent;
  partial.camera = std::move(m.camera);
  if (m.has_splat_layer) {
    partial.splats = m.collect_splats();
    m.pages.clear();
    partial.light_paths = m.counters.light_paths;
  }
  partial.counters = m.counters;
  partial.cpu_seconds = m.cpu_seconds;
  return partial;
}

}  // namespace lightmill
