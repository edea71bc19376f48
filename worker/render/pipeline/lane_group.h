#pragma once
// Groups of paths in lanes, taken from a list of their slots, and back.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A group of up to kLanes active paths; lanes past the end repeat the last one.
struct Group {
  LaneInt slot;
  LaneMask active;
  Group(const int32_t* ids, int count) {
    const LaneInt i = lane_index<Lane>();
    active = LaneMask(i < count);
    slot = gather(ids, select(active, i, splat_int<Lane>(count - 1)));
  }
  /// The slots from `base` on.
  Group(const std::vector<int32_t>& slots, size_t base)
      : Group(slots.data() + base, static_cast<int>(std::min<size_t>(kLanes, slots.size() - base))) {}
};

/// Adds the slots of the lanes in `mask`.
inline void append(std::vector<int32_t>* slots, LaneInt slot, LaneMask mask) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1)
    slots->push_back(lane(slot, std::countr_zero(bits)));
}

}  // namespace lightmill
