#pragma once
// What Cryptomatte is formed of: for every pixel, how much of its samples hit what first.
//
// Ranks by coverage can't be added up, counts can. So partials and films keep all of a pixel's counts, as
// integers, and ranks are formed when the image is resolved (matte_film.h). One list serves the three mattes:
// its keys are the names of an object, its material and its asset together.
//
// Names travel in the partials that count them. So the coordinator knows the names of what is seen without
// reading the scene, and numbers mean something only beside their names. So do what the AOVs objectid and
// materialid say: of a pixel the one that most of its samples hit.
#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/film/cryptomatte/matte_names.h"
#include "common/job/aovs.h"
#include "common/job/packet_grid.h"

namespace lightmill {

class ByteReader;
class ByteWriter;

enum Matte { kObjectMatte, kMaterialMatte, kAssetMatte, kMattes };
inline constexpr Aovs kAovOfMatte[kMattes] = {kAovCryptoObject, kAovCryptoMaterial, kAovCryptoAsset};

/// The numbers of three names, in the order of Matte, the object's in the highest bits.
using MatteKey = uint64_t;
inline constexpr MatteKey matte_key(uint32_t object, uint32_t material, uint32_t asset) {
  return MatteKey{object} << 2 * kMatteNameBits | MatteKey{material} << kMatteNameBits | asset;
}
inline constexpr uint32_t name_of(MatteKey key, int matte) {
  return static_cast<uint32_t>(key >> (kMattes - 1 - matte) * kMatteNameBits) & (kMaxMatteNames - 1);
}

/// What the AOVs objectid and materialid say of an object and of a material of a name: the number that the
/// scene file gives the first such thing, else its place among the names of objects or of materials, from 1.
struct ThingIds {
  uint32_t object = 0, material = 0;
  bool operator==(const ThingIds&) const = default;
};
/// Floats hold all whole numbers up to here.
inline constexpr uint32_t kMaxThingId = (1u << 24) - 1;

/// The names of a scene, and what their things are numbered; as many of both.
struct MatteList {
  std::vector<std::string> names;
  std::vector<ThingIds> ids;
};

/// Samples that hit this first: their number, or where they have weights the sum of weight * kWeightOne.
struct MatteCount {
  MatteKey key = 0;
  uint64_t count = 0;
  bool operator==(const MatteCount&) const = default;
};

/// The counts of a packet's pixels, row-major in its square. Both are empty if nothing is counted.
struct MatteCell {
  std::vector<uint32_t> ends;      // of each pixel's part of `counts`
  std::vector<MatteCount> counts;  // of a pixel ascending by key
  std::span<const MatteCount> of(size_t pixel) const {
    if (ends.empty()) return {};
    const uint32_t begin = pixel == 0 ? 0 : ends[pixel - 1];
    return std::span(counts).subspan(begin, ends[pixel] - begin);
  }
  bool operator==(const MatteCell&) const = default;
};

/// Of a tile or a film. In a partial names ascend, and each is of a key that is counted: the same counts are
/// the same bytes.
struct MatteSums {
  std::vector<std::string> names;
  std::vector<MatteCell> cells;  // of the tile or film, row-major
  std::vector<ThingIds> ids;     // of names; empty where no AOV asks for them
  bool operator==(const MatteSums&) const = default;
};

/// Adds `from`, in whose keys name i is number renumber[i] in those of `to`; empty: the same.
void add_counts(const MatteCell& from, std::span<const uint32_t> renumber, MatteCell* to);
/// The same counts with names as a partial has them.
MatteSums canonical(const MatteSums& sums);

/// The bytes of canonical sums, in a partial and in a film's snapshot.
void encode_mattes(const MatteSums& sums, ByteWriter* out);
/// Inverse, of so many cells. Throws Error(kFailed) for what encode_mattes can't have written, and for more
/// than `most_counts`, before there is memory for them.
MatteSums decode_mattes(ByteReader* in, size_t cells, uint64_t most_counts);
/// Most counts of a tile of `pixels` pixels of `samples` samples, and most bytes that encode_mattes gives for
/// them.
uint64_t most_matte_counts(size_t pixels, int64_t samples);
size_t max_matte_bytes(size_t cells, uint64_t counts);
/// About the memory that a pixel's counts take.
inline constexpr double kMatteBytesPerPixel = 4 * sizeof(MatteCount);

/// Throws Error(kFailed) unless the sums are canonical and of the cells `cells` of the grid, and count no
/// pixel outside of its crop window.
void check_mattes(const MatteSums& sums, const FilmGrid& grid, const CellRect& cells);

}  // namespace lightmill
