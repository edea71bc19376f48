// The bytes of Cryptomatte's counts:
//
//   names: count, + kHasIds if so; for each the number of its bytes less one, and text
//   with kHasIds: for each name two varints, as ThingIds
//   keys that are counted: count; three varints each, numbers of names
//   for each pixel of each cell: the number of its counts as a varint; for each of them two varints, the gap
//   to its key in the list of keys, and the count
#include <algorithm>
#include <unordered_set>
#include <utility>

#include "common/base/error.h"
#include "common/film/cryptomatte/matte_sums.h"
#include "common/film/packing.h"
#include "common/job/sample_allocation.h"

namespace lightmill {
namespace {

constexpr size_t kSizeBytes = 4, kLeastNameBytes = 2, kLeastKeyBytes = kMattes, kLeastCountBytes = 2;
constexpr size_t kMostKeyBytes = 3 * kMattes, kMostCountBytes = 5 + 10, kMostPixelBytes = 5,
                 kMostIdBytes = 2 * 4;
constexpr uint32_t kHasIds = 1u << 31;
/// Of a partial: far more than a tile of a second's work has samples.
constexpr uint64_t kMaxMatteCounts = uint64_t{1} << 26;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorKind::kFailed, "Cryptomatte's counts are invalid: " + why);
}

/// A number of things of at least `least` bytes each, which must be there.
size_t get_size(ByteReader* in, uint64_t most, size_t least, uint32_t size) {
  if (size > most || size > in->rest().size() / least) refuse("more than there can be");
  return size;
}

size_t get_size(ByteReader* in, uint64_t most, size_t least) {
  return get_size(in, most, least, in->get<uint32_t>());
}

void read_names(ByteReader* in, MatteSums* sums) {
  const auto head = in->get<uint32_t>();
  sums->names.resize(get_size(in, kMaxMatteNames, kLeastNameBytes, head & ~kHasIds));
  for (std::string& name : sums->names) name = in->get_bytes(size_t{in->get<uint8_t>()} + 1);
  if (!(head & kHasIds)) return;
  const auto id = [&] {
    const uint64_t given = in->get_varint();
    if (given > kMaxThingId) refuse("a number that is too large");
    return static_cast<uint32_t>(given);
  };
  for (size_t i = 0; i < sums->names.size(); ++i) {
    const uint32_t object = id();
    sums->ids.push_back({object, id()});
  }
}

std::vector<MatteKey> read_keys(ByteReader* in, size_t names, uint64_t most) {
  std::vector<MatteKey> keys(get_size(in, most, kLeastKeyBytes));
  for (MatteKey& key : keys) {
    uint32_t numbers[kMattes];
    for (uint32_t& number : numbers) {
      const uint64_t given = in->get_varint();
      if (given >= names) refuse("a name that is not there");
      number = static_cast<uint32_t>(given);
    }
    key = matte_key(numbers[kObjectMatte], numbers[kMaterialMatte], numbers[kAssetMatte]);
  }
  for (size_t i = 1; i < keys.size(); ++i) {
    if (keys[i - 1] >= keys[i]) refuse("keys are not in ascending order");
  }
  return keys;
}

/// `counts`: those that may still come.
MatteCell read_cell(ByteReader* in, const std::vector<MatteKey>& keys, uint64_t* counts,
                    std::vector<bool>* used) {
  MatteCell cell;
  cell.ends.reserve(kCellPixels);
  for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
    const uint64_t count = in->get_varint();
    if (count > *counts || count > in->rest().size() / kLeastCountBytes) refuse("more than there can be");
    *counts -= count;
    uint64_t next = 0;
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t gap = in->get_varint();
      if (gap >= keys.size() || next + gap >= keys.size()) refuse("a key that is not there");
      (*used)[static_cast<size_t>(next + gap)] = true;
      cell.counts.push_back({keys[static_cast<size_t>(next + gap)], in->get_varint()});
      next += gap + 1;
    }
    cell.ends.push_back(static_cast<uint32_t>(cell.counts.size()));
  }
  if (cell.counts.empty()) return {};
  return cell;
}

void check_names(const std::vector<std::string>& names) {
  size_t bytes = 0;
  for (size_t i = 0; i < names.size(); ++i) {
    if (!valid_matte_name(names[i])) refuse("a name that is none");
    if (i > 0 && names[i - 1] >= names[i]) refuse("names are not in ascending order");
    bytes += names[i].size();
  }
  if (names.size() > kMaxMatteNames || bytes > kMaxMatteText) refuse("more names than a scene may have");
}

/// That there is no name that nothing is called.
void check_uses(size_t names, std::vector<bool> used) {
  used.resize(names);
  if (std::find(used.begin(), used.end(), false) != used.end()) refuse("a name of nothing");
}

void note_names(MatteKey key, std::vector<bool>* used) {
  for (int matte = 0; matte < kMattes; ++matte) {
    if (name_of(key, matte) >= used->size()) refuse("a name that is not there");
    (*used)[name_of(key, matte)] = true;
  }
}

/// `inside`: its pixels in the crop window.
void check_cell(const MatteCell& cell, const PixelRect& inside, int x0, int y0, std::vector<bool>* used) {
  if (cell.ends.empty() && cell.counts.empty()) return;
  if (cell.ends.size() != kCellPixels || cell.ends.back() != cell.counts.size() || cell.counts.empty() ||
      !std::is_sorted(cell.ends.begin(), cell.ends.end()))
    refuse("a cell of another form");
  for (int i = 0; i < kCellPixels; ++i) {
    const std::span<const MatteCount> counts = cell.of(static_cast<size_t>(i));
    if (counts.empty()) continue;
    const int x = x0 + i % kCellSize, y = y0 + i / kCellSize;
    if (x < inside.x0 || x >= inside.x1 || y < inside.y0 || y >= inside.y1)
      refuse("a pixel outside the crop window");
    for (size_t k = 0; k < counts.size(); ++k) {
      if (counts[k].count == 0 || (k > 0 && counts[k - 1].key >= counts[k].key))
        refuse("a pixel's counts are not in ascending order");
      note_names(counts[k].key, used);
    }
  }
}

std::vector<MatteKey> keys_of(const MatteSums& sums) {
  std::unordered_set<MatteKey> known;
  MatteKey last = ~MatteKey{0};  // of no names: pixels beside each other often have the same
  for (const MatteCell& cell : sums.cells) {
    for (const MatteCount& entry : cell.counts) {
      if (entry.key != last) known.insert(last = entry.key);
    }
  }
  std::vector<MatteKey> keys(known.begin(), known.end());
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace

void encode_mattes(const MatteSums& sums, ByteWriter* out) {
  const std::vector<MatteKey> keys = keys_of(sums);
  out->put<uint32_t>(static_cast<uint32_t>(sums.names.size()) | (sums.ids.empty() ? 0 : kHasIds));
  for (const std::string& name : sums.names) {
    out->put<uint8_t>(static_cast<uint8_t>(name.size() - 1));
    out->put_bytes(name);
  }
  for (const ThingIds& ids : sums.ids) {
    out->put_varint(ids.object);
    out->put_varint(ids.material);
  }
  out->put<uint32_t>(static_cast<uint32_t>(keys.size()));
  for (const MatteKey key : keys) {
    for (int matte = 0; matte < kMattes; ++matte) out->put_varint(name_of(key, matte));
  }
  for (const MatteCell& cell : sums.cells) {
    for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
      const std::span<const MatteCount> counts = cell.of(pixel);
      out->put_varint(counts.size());
      auto next = keys.begin();
      for (const MatteCount& entry : counts) {
        const auto at = std::lower_bound(next, keys.end(), entry.key);
        out->put_varint(static_cast<uint64_t>(at - next));
        out->put_varint(entry.count);
        next = at + 1;
      }
    }
  }
}

MatteSums decode_mattes(ByteReader* in, size_t cells, uint64_t most_counts) {
  MatteSums sums;
  read_names(in, &sums);
  check_names(sums.names);
  const std::vector<MatteKey> keys = read_keys(in, sums.names.size(), most_counts);
  std::vector<bool> names_used(sums.names.size()), keys_used(keys.size());
  for (const MatteKey key : keys) note_names(key, &names_used);
  check_uses(sums.names.size(), std::move(names_used));
  if (cells > in->rest().size() / kCellPixels) refuse("pixels are missing");
  sums.cells.reserve(cells);
  for (size_t i = 0; i < cells; ++i) sums.cells.push_back(read_cell(in, keys, &most_counts, &keys_used));
  check_uses(keys.size(), std::move(keys_used));
  return sums;
}

uint64_t most_matte_counts(size_t pixels, int64_t samples) {
  const uint64_t of_pixel = static_cast<uint64_t>(samples) * kMaxSamplesPerIndex;
  // Samples of a tile are below 2^31, pixels of an image below 2^31: no overflow.
  return std::min(uint64_t{pixels} * of_pixel, kMaxMatteCounts);
}

size_t max_matte_bytes(size_t cells, uint64_t counts) {
  const size_t most = static_cast<size_t>(counts), names = std::min(kMattes * most, kMaxMatteNames);
  return kSizeBytes + names * (1 + kMostIdBytes) + std::min(names * kMaxMatteName, kMaxMatteText) +
         kSizeBytes + most * (kMostKeyBytes + kMostCountBytes) + cells * kCellPixels * kMostPixelBytes;
}

void check_mattes(const MatteSums& sums, const FilmGrid& grid, const CellRect& cells) {
  check_names(sums.names);
  if (!sums.ids.empty() && sums.ids.size() != sums.names.size()) refuse("not a number for each name");
  for (const ThingIds& ids : sums.ids) {
    if (ids.object > kMaxThingId || ids.material > kMaxThingId) refuse("a number that is too large");
  }
  if (sums.cells.size() != static_cast<size_t>(cells.count())) refuse("cells are missing");
  std::vector<bool> used(sums.names.size());
  auto cell = sums.cells.begin();
  for (int y = cells.y0; y < cells.y1; ++y) {
    for (int x = cells.x0; x < cells.x1; ++x, ++cell) {
      check_cell(*cell, grid.pixels({x, y, x + 1, y + 1}), x * kCellSize, y * kCellSize, &used);
    }
  }
  check_uses(sums.names.size(), std::move(used));
}

}  // namespace lightmill
