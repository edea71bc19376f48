#pragma once
// What benches of the farm hand in: partials that are quick to make.
#include <string>

#include "common/farm/farm_types.h"
#include "common/film/partial.h"

namespace lightmill {

/// The grant's tile in one grey, encoded, as by a worker that took `cpu_seconds`.
inline std::string grey_partial(const LeaseGrant& grant, double cpu_seconds) {
  Partial partial;
  partial.tile = grant.tile;
  partial.grid = grant.settings.grid;
  partial.quantum_exponent = -40;
  const auto area = static_cast<size_t>(partial.grid.pixels(grant.tile.cells).area());
  ExactRgb grey;
  for (auto& c : grey.c) c = static_cast<Units>(grant.tile.samples()) << 38;
  partial.camera.assign(area, grey);
  partial.counters.camera_paths = area * static_cast<uint64_t>(grant.tile.samples());
  partial.cpu_seconds = cpu_seconds;
  return encode_partial(partial);
}

}  // namespace lightmill
