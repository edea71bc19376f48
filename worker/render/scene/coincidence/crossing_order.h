#pragma once
// The order in which surfaces that coincide are crossed.
//
// A *sheet* is what one body has of its surface in a place where several coincide. It faces up or down, to
// where its outside is. Bodies that touch are left before the next is entered: sheets that face up lie below
// those that face down. Among those that face alike:
//   - what light passes (glass, boundaries of media, alpha masks): the body whose outside medium is another's
//     inside is the inner one, else the smaller one is; the inner one lies behind.
//   - opaque: the smaller one lies in front, as a decal does on its wall. A solid body lies behind all that
//     light passes, and so does a flat one, unless it is smaller.
//   - of equal size: the later one lies in front.
// Opaque bodies face to where they are seen from: `facing` has to say so. An emitter with one side lies in
// front of flat sheets on that side, whatever they face.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

struct Sheet {
  int facing = 1;  // 1: up, -1: down
  bool passes = false, flat = false;
  bool emits_one_sided = false;
  MediumInterface media;
  double size = 0;     // of the body
  uint64_t place = 0;  // of the body in the file
};

/// Indices of `sheets` from the lowest to the highest.
std::vector<size_t> crossing_order(const std::vector<Sheet>& sheets);

/// How many steps each sheet lies above the largest one, if those that overlap (`touching`, pairs of indices)
/// are to be a step apart or more. A sheet lies as low as those below let it, at most 32 steps away.
std::vector<int> steps_apart(const std::vector<Sheet>& sheets,
                             const std::vector<std::pair<size_t, size_t>>& touching);

}  // namespace lightmill
