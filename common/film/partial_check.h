#pragma once
// What a partial must satisfy, whoever sent it.
#include <string>

#include "common/film/partial.h"

namespace lightmill {

/// Throws Error(kFailed, "partial is invalid: REASON").
[[noreturn]] void refuse_partial(const std::string& reason);
/// Grid, tile, quantum and counts: everything that can be checked before layers are read.
void check_partial_head(const Partial& partial);
/// What checking the layers shows on the way: all units of a layer's sums, or'd together.
struct LayerUnits {
  Units camera = 0, splats = 0;
};
/// Sizes, order, places and ranges of the layers, given a good head.
LayerUnits check_partial_layers(const Partial& partial);

}  // namespace lightmill
