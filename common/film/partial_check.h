#pragma once
// Checks what a partial must satisfy, whoever sent it.
#include <string>

#include "common/film/partial.h"

namespace lightmill {

/// Throws Error(kFailed, "partial is invalid: REASON").
[[noreturn]] void refuse_partial(const std::string& reason);
/// Checks grid, tile, quantum and counts: everything that can be checked before layers are read.
void check_partial_head(const Partial& partial);
/// All units of a layer's sums, or'd together: known once the layers are checked.
struct LayerUnits {
  Units camera = 0, splats = 0;
};
/// Checks sizes, order, places and ranges of the layers. The head must be good.
LayerUnits check_partial_layers(const Partial& partial);

}  // namespace lightmill
