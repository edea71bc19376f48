#pragma once
// What a partial of a tile must be, and how large it may be. Pure: the codec has checked the partial in
// itself (common/film/partial_check.h), this compares it with its tile.
#include <cstdint>
#include <optional>

#include "common/film/film.h"
#include "common/job/settings.h"

namespace lightmill {

/// Throws Error(kFailed) with the reason if a decoded partial is not what the lease asked for.
/// `quantum_exponent`: that of the job's earlier partials; absent before the first one.
void check_partial(const Partial& partial, const TileSpec& tile, const RenderSettings& settings,
                   const std::optional<int>& quantum_exponent);
/// About the memory that a partial of the tile takes unpacked, with what it is unpacked from.
double decoded_bytes(const TileSpec& tile, const RenderSettings& settings);
/// Largest encoded partial of the tile.
uint64_t max_encoded_bytes(const TileSpec& tile, const RenderSettings& settings);

}  // namespace lightmill
