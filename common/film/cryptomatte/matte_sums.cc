#include "common/film/cryptomatte/matte_sums.h"

#include <algorithm>
#include <numeric>

namespace lightmill {
namespace {

MatteKey renumbered(MatteKey key, std::span<const uint32_t> renumber) {
  const auto of = [&](int matte) { return renumber[name_of(key, matte)]; };
  return renumber.empty() ? key : matte_key(of(kObjectMatte), of(kMaterialMatte), of(kAssetMatte));
}

bool by_key(const MatteCount& a, const MatteCount& b) { return a.key < b.key; }

}  // namespace

void add_counts(const MatteCell& from, std::span<const uint32_t> renumber, MatteCell* to) {
  if (from.counts.empty()) return;
  MatteCell sum;
  sum.ends.reserve(kCellPixels);
  sum.counts.reserve(std::max(from.counts.size(), to->counts.size()));
  std::vector<MatteCount> more;
  for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
    const std::span<const MatteCount> added = from.of(pixel), there = to->of(pixel);
    more.assign(added.begin(), added.end());
    for (MatteCount& entry : more) entry.key = renumbered(entry.key, renumber);
    std::sort(more.begin(), more.end(), by_key);
    const size_t begin = sum.counts.size();
    const auto append = [&](const MatteCount& entry) {
      if (sum.counts.size() > begin && sum.counts.back().key == entry.key) {
        sum.counts.back().count += entry.count;
      } else {
        sum.counts.push_back(entry);
      }
    };
    auto next = there.begin();
    for (const MatteCount& entry : more) {
      for (; next != there.end() && next->key <= entry.key; ++next) append(*next);
      append(entry);
    }
    for (; next != there.end(); ++next) append(*next);
    sum.ends.push_back(static_cast<uint32_t>(sum.counts.size()));
  }
  *to = std::move(sum);
}

MatteSums canonical(const MatteSums& sums) {
  std::vector<bool> used(sums.names.size());
  for (const MatteCell& cell : sums.cells) {
    for (const MatteCount& entry : cell.counts) {
      for (int matte = 0; matte < kMattes; ++matte) used[name_of(entry.key, matte)] = true;
    }
  }
  std::vector<uint32_t> order(sums.names.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](uint32_t name) { return !used[name]; });
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return sums.names[a] < sums.names[b]; });
  MatteSums out;
  std::vector<uint32_t> renumber(sums.names.size());
  for (const uint32_t name : order) {
    renumber[name] = static_cast<uint32_t>(out.names.size());
    out.names.push_back(sums.names[name]);
    if (!sums.ids.empty()) out.ids.push_back(sums.ids[name]);
  }
  out.cells.resize(sums.cells.size());
  for (size_t i = 0; i < out.cells.size(); ++i) add_counts(sums.cells[i], renumber, &out.cells[i]);
  return out;
}

}  // namespace lightmill
