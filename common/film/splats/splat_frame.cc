#include "common/film/splats/splat_frame.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <mutex>

#include "common/film/signed_sum.h"

namespace lightmill {

namespace {

constexpr size_t kPageLocks = 64;
constexpr uint32_t kPrefetch = 12;  // splats ahead
constexpr int kDroppedBits = 24 - kSplatBits;

/// To the nearest of kSplatBits significant bits, half away from zero; what is no number stays what it is.
float rounded(float x) {
  const auto bits = std::bit_cast<uint32_t>(std::fabs(x));
  constexpr uint32_t kHalf = 1u << (kDroppedBits - 1), kMask = ~((1u << kDroppedBits) - 1);
  return bits >= 0x7f800000u ? x : std::copysign(std::bit_cast<float>((bits + kHalf) & kMask), x);
}

}  // namespace

// The splat frame is cut into pages, one per cell of the crop window, which are made when the first splat
// arrives. A packet's splats are sorted by page first: one lock per page and packet instead of one per
// splat, and the additions stay in the cache.
struct SplatFrame::Impl {
  using Page = std::array<ExactRgb, kCellPixels>;

  FilmGrid grid;
  int quantum_exponent = 0;
  CellRect frame_cells;                           // of the crop window
  std::array<std::mutex, kPageLocks> page_locks;  // page -> lock
  std::vector<std::unique_ptr<Page>> pages;
};

SplatFrame::SplatFrame() = default;
SplatFrame::SplatFrame(SplatFrame&&) noexcept = default;
SplatFrame& SplatFrame::operator=(SplatFrame&&) noexcept = default;
SplatFrame::~SplatFrame() = default;

SplatFrame::SplatFrame(const FilmGrid& grid, int quantum_exponent) : impl_(std::make_unique<Impl>()) {
  impl_->grid = grid;
  impl_->quantum_exponent = quantum_exponent;
  impl_->frame_cells = grid.cells();
  impl_->pages.resize(static_cast<size_t>(impl_->frame_cells.count()));
}

Dropped SplatFrame::add(std::span<const Splat> splats) {
  Impl& m = *impl_;
  const auto width = static_cast<uint32_t>(m.grid.width);
  const auto frame_width = static_cast<uint32_t>(m.frame_cells.width());
  const PixelRect& crop = m.grid.crop;

  // Counting sort by page. A key is page * kCellPixels + pixel within the page; kOutside is dropped. The
  // splats themselves are sorted, as each is then read where it lies and not far away.
  constexpr uint64_t kOutside = ~uint64_t{0};
  const auto keys = std::make_unique_for_overwrite<uint64_t[]>(splats.size());
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
  const auto sorted = std::make_unique_for_overwrite<Splat[]>(begin.back());  // by pixel within the page
  std::vector<uint32_t> cursor(begin.begin(), begin.end() - 1);
  for (size_t i = 0; i < splats.size(); ++i) {
    if (keys[i] == kOutside) continue;
    Splat& to = sorted[cursor[keys[i] / kCellPixels]++];
    to = splats[i];
    to.pixel = static_cast<uint32_t>(keys[i] % kCellPixels);
  }

  Dropped dropped;
  for (size_t p = 0; p < m.pages.size(); ++p) {
    if (begin[p] == begin[p + 1]) continue;
    const std::lock_guard lock(m.page_locks[p % kPageLocks]);
    if (!m.pages[p]) m.pages[p] = std::make_unique<Impl::Page>();
    Impl::Page& page = *m.pages[p];
    for (uint32_t k = begin[p]; k < begin[p + 1]; ++k) {
      // Few of a page's sums are in a cache: they are fetched while others are added. (Not in a function of
      // its own: GCC 12 would find it without effect.)
      const uint32_t ahead = std::min(k + kPrefetch, begin[p + 1] - 1);
      const auto* next = reinterpret_cast<const char*>(&page[sorted[ahead].pixel]);
      __builtin_prefetch(next, 1);
      __builtin_prefetch(next + sizeof(ExactRgb) - 1, 1);
      const Splat& splat = sorted[k];
      const auto r = to_signed_units(rounded(splat.r), m.quantum_exponent);
      const auto g = to_signed_units(rounded(splat.g), m.quantum_exponent);
      const auto b = to_signed_units(rounded(splat.b), m.quantum_exponent);
      if (!r || !g || !b) {
        dropped.refuse({splat.r, splat.g, splat.b}, m.quantum_exponent, 1);
        continue;
      }
      // One channel says of most splats that they are not that small.
      if (!*g && !(*r | *b)) {
        dropped.round_to_zero({splat.r, splat.g, splat.b});
        continue;
      }
      ExactRgb& sum = page[splat.pixel];
      sum.c[0] += *r;
      sum.c[1] += *g;
      sum.c[2] += *b;
    }
  }
  return dropped;
}

std::vector<SplatSum> SplatFrame::take() {
  auto& [grid, quantum_exponent, frame_cells, page_locks, pages] = *impl_;
  size_t count = 0;
  for (const auto& page : pages) {
    if (!page) continue;
    for (const ExactRgb& sum : *page) count += !sum.is_zero();
  }
  std::vector<SplatSum> splats;
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
  pages.clear();
  return splats;
}

}  // namespace lightmill
