#include "worker/render/pipeline/recording/matte_recorder.h"

#include <algorithm>

namespace lightmill {

void MatteRecorder::begin_packet() {
  for (std::vector<MatteCount>& counts : counts_) counts.clear();
}

void MatteRecorder::add(size_t pixel, size_t slot, uint64_t count) {
  std::vector<MatteCount>& counts = counts_[pixel];
  const MatteKey key = keys_[slot];
  const auto found =
      std::find_if(counts.begin(), counts.end(), [&](const MatteCount& entry) { return entry.key == key; });
  if (found != counts.end()) {
    found->count += count;
  } else {
    counts.push_back({key, count});
  }
}

MatteCell MatteRecorder::cell() {
  MatteCell cell;
  cell.ends.reserve(kCellPixels);
  for (std::vector<MatteCount>& counts : counts_) {
    std::sort(counts.begin(), counts.end(),
              [](const MatteCount& a, const MatteCount& b) { return a.key < b.key; });
    cell.counts.insert(cell.counts.end(), counts.begin(), counts.end());
    cell.ends.push_back(static_cast<uint32_t>(cell.counts.size()));
  }
  return cell;
}

}  // namespace lightmill
