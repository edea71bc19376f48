#pragma once
// What a partial must satisfy, whoever sent it.
#include <string>

#include "common/image/partial.h"

namespace lightmill {

/// Throws Error(kFailed, "partial is invalid: REASON").
[[noreturn]] void refuse_partial(const std::string& reason);
/// Grid, tile, quantum and counts: everything that can be checked before layers are read.
void check_partial_head(const Partial& partial);
/// Sizes, order, places and ranges of the layers, given a good head.
void check_partial_layers(const Partial& partial);

}  // namespace lightmill
