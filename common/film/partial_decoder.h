#pragma once
// Decodes partials one after the other in the same memory. Otherwise the system would give memory, zeroed,
// and take it back for each of them, which takes a third of the time of merging.
//
//   PartialDecoder decoder;
//   const Partial& partial = decoder.decode(bytes, grid, tile);
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "common/film/partial.h"

namespace lightmill {

/// Memory of varying size. Its content is lost when it is asked for anew.
class ReusedBytes {
 public:
  std::span<char> of(size_t size) {
    if (size > capacity_) {
      bytes_.reset();  // before there is a second one
      bytes_ = std::make_unique_for_overwrite<char[]>(size);
      capacity_ = size;
    }
    return {bytes_.get(), size};
  }
  size_t capacity() const { return capacity_; }

 private:
  std::unique_ptr<char[]> bytes_;
  size_t capacity_ = 0;
};

class PartialDecoder {
 public:
  /// decode_partial(bytes, grid, tile); refuses more than `most_groups` light groups, and lobes and counts
  /// for Cryptomatte that are not in `most`, before it allocates them. The result is valid until the next
  /// call.
  const Partial& decode(std::string_view bytes, const FilmGrid& grid, const TileSpec& tile,
                        size_t most_groups = kMaxLightGroups, Aovs most = kAllAovs);
  /// Bytes of memory that it keeps.
  size_t bytes() const;

 private:
  Partial partial_;
  ReusedBytes payload_;
};

}  // namespace lightmill
