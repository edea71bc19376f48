#pragma once
// Cryptomatte's counts of a film: folded, and resolved into ranks and manifests.
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/film/cryptomatte/matte_sums.h"

namespace lightmill {

class MatteFilm {
 public:
  /// Throws Error(kFailed), without having changed anything, if there would be more names than a scene has,
  /// or if what a name's things are numbered is not what it was.
  void check(const MatteSums& partial) const;
  /// Adds what check() accepted: counts of the cells `cells` of the grid.
  void fold(const FilmGrid& grid, const CellRect& cells, const MatteSums& partial);
  /// The id and coverage of each of kMatteRanks ranks of pixel `pixel` of cell number `cell`, whose samples'
  /// weights add up to `weights`. Coverages fall; of equal ones the smaller bits of the id come first.
  void ranks(size_t cell, size_t pixel, Matte matte, int64_t weights, float* out) const;
  /// The number (ThingIds) of the objects or of the materials that most samples of a pixel hit; of those that
  /// as many hit the least one, and 0 where nothing is hit. Not of assets.
  uint32_t id(size_t cell, size_t pixel, Matte matte) const;
  /// What a file says of the mattes in the set: their names, how ids are made, and the id of each name that
  /// is seen.
  std::map<std::string, std::string> attributes(Aovs set) const;

  /// Part of the film's snapshot: the same bytes for the same counts, in whatever order they came.
  void write(ByteWriter* out) const;
  void read(ByteReader* in, const FilmGrid& grid);

 private:
  uint32_t number(const std::string& name, const ThingIds* ids);
  std::string manifest(Matte matte) const;

  MatteSums sums_;             // names in the order in which they came
  std::vector<uint32_t> ids_;  // bits, by name
  std::unordered_map<std::string, uint32_t> numbers_;
  size_t text_bytes_ = 0;
};

}  // namespace lightmill
