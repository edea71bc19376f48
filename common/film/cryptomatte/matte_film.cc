#include "common/film/cryptomatte/matte_film.h"

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/error.h"
#include "common/film/packing.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"

namespace lightmill {
namespace {

/// Of one id in a pixel.
struct Rank {
  uint32_t id;
  uint64_t count;
};

/// A pixel's ids by id(entry), in falling order of their counts; of equal ones the smaller id comes first.
template <class Id>
std::vector<Rank> ranks_by(std::span<const MatteCount> counts, const Id& id) {
  std::vector<Rank> found;
  found.reserve(counts.size());
  for (const MatteCount& entry : counts) found.push_back({id(entry), entry.count});
  // Several keys have the same name, and several names may have the same id.
  std::sort(found.begin(), found.end(), [](const Rank& a, const Rank& b) { return a.id < b.id; });
  size_t last = 0;
  for (size_t i = 1; i < found.size(); ++i) {
    if (found[i].id == found[last].id) {
      found[last].count += found[i].count;
    } else {
      found[++last] = found[i];
    }
  }
  if (!found.empty()) found.resize(last + 1);
  std::stable_sort(found.begin(), found.end(),
                   [](const Rank& a, const Rank& b) { return a.count > b.count; });
  return found;
}

}  // namespace

void MatteFilm::check(const MatteSums& partial) const {
  size_t names = sums_.names.size(), bytes = text_bytes_;
  for (size_t i = 0; i < partial.names.size(); ++i) {
    const std::string& name = partial.names[i];
    if (const auto known = numbers_.find(name); known != numbers_.end()) {
      if (!partial.ids.empty() && !sums_.ids.empty() && partial.ids[i] != sums_.ids[known->second])
        throw Error(ErrorKind::kFailed, "partial numbers \"" + name + "\" otherwise than those before it");
      continue;
    }
    ++names;
    bytes += name.size();
  }
  if (names > kMaxMatteNames || bytes > kMaxMatteText)
    throw Error(ErrorKind::kFailed, "partial has more names for Cryptomatte than a scene may have");
}

uint32_t MatteFilm::number(const std::string& name, const ThingIds* ids) {
  const auto [entry, is_new] = numbers_.try_emplace(name, static_cast<uint32_t>(sums_.names.size()));
  if (is_new) {
    sums_.names.push_back(name);
    ids_.push_back(cryptomatte_bits(name));
    if (ids) sums_.ids.push_back(*ids);
    text_bytes_ += name.size();
  }
  return entry->second;
}

void MatteFilm::fold(const FilmGrid& grid, const CellRect& cells, const MatteSums& partial) {
  const CellRect all = grid.cells();
  sums_.cells.resize(static_cast<size_t>(all.count()));
  std::vector<uint32_t> renumber;
  renumber.reserve(partial.names.size());
  for (size_t i = 0; i < partial.names.size(); ++i)
    renumber.push_back(number(partial.names[i], partial.ids.empty() ? nullptr : &partial.ids[i]));
  auto from = partial.cells.begin();
  for (int y = cells.y0; y < cells.y1; ++y) {
    for (int x = cells.x0; x < cells.x1; ++x, ++from) {
      const int64_t cell = int64_t{y - all.y0} * all.width() + x - all.x0;
      add_counts(*from, renumber, &sums_.cells[static_cast<size_t>(cell)]);
    }
  }
}

void MatteFilm::ranks(size_t cell, size_t pixel, Matte matte, int64_t weights, float* out) const {
  std::fill_n(out, 2 * kMatteRanks, 0.0f);
  if (cell >= sums_.cells.size() || weights <= 0) return;
  const std::vector<Rank> found = ranks_by(
      sums_.cells[cell].of(pixel), [&](const MatteCount& entry) { return ids_[name_of(entry.key, matte)]; });
  const size_t most = std::min<size_t>(found.size(), kMatteRanks);
  for (size_t i = 0; i < most; ++i) {
    out[2 * i] = std::bit_cast<float>(found[i].id);
    out[2 * i + 1] = static_cast<float>(static_cast<double>(found[i].count) / static_cast<double>(weights));
  }
}

uint32_t MatteFilm::id(size_t cell, size_t pixel, Matte matte) const {
  if (cell >= sums_.cells.size()) return 0;
  const std::vector<Rank> found = ranks_by(sums_.cells[cell].of(pixel), [&](const MatteCount& entry) {
    const ThingIds& ids = sums_.ids[name_of(entry.key, matte)];
    return matte == kObjectMatte ? ids.object : ids.material;
  });
  return found.empty() ? 0 : found.front().id;
}

std::string MatteFilm::manifest(Matte matte) const {
  std::vector<bool> seen(sums_.names.size());
  for (const MatteCell& cell : sums_.cells) {
    for (const MatteCount& entry : cell.counts) seen[name_of(entry.key, matte)] = true;
  }
  std::vector<const std::string*> names;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) names.push_back(&sums_.names[i]);
  }
  std::sort(names.begin(), names.end(), [](const auto* a, const auto* b) { return *a < *b; });
  std::string text = "{";
  for (const std::string* name : names) {
    if (text.size() > 1) text += ',';
    text += nlohmann::json(*name).dump() + ":\"" + cryptomatte_hex(*name) + '"';
  }
  return text + "}";
}

std::map<std::string, std::string> MatteFilm::attributes(Aovs set) const {
  std::map<std::string, std::string> attributes;
  for (int matte = 0; matte < kMattes; ++matte) {
    if (!(set & kAovOfMatte[matte])) continue;
    const std::string layer = matte_layer(kAovOfMatte[matte]), prefix = cryptomatte_prefix(layer);
    attributes[prefix + "name"] = layer;
    attributes[prefix + "hash"] = "MurmurHash3_32";
    attributes[prefix + "conversion"] = "uint32_to_float32";
    attributes[prefix + "manifest"] = manifest(static_cast<Matte>(matte));
  }
  return attributes;
}

void MatteFilm::write(ByteWriter* out) const { encode_mattes(canonical(sums_), out); }

void MatteFilm::read(ByteReader* in, const FilmGrid& grid) {
  const auto cells = static_cast<size_t>(grid.cells().count());
  // The snapshot is our own: its digest was checked.
  MatteSums sums = decode_mattes(in, cells, ~uint64_t{0});
  check_mattes(sums, grid, grid.cells());
  *this = {};
  for (size_t i = 0; i < sums.names.size(); ++i)
    number(sums.names[i], sums.ids.empty() ? nullptr : &sums.ids[i]);
  sums_.cells = std::move(sums.cells);
}

}  // namespace lightmill
