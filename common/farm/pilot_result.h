#pragma once
// What a worker commits for a job's pilot, and its bytes.
#include <string>

#include "common/job/packet_grid.h"
#include "common/job/pilot_report.h"

namespace lightmill {

/// The pilot's place in a ledger: the tile without cells and samples. It is leased, renewed, lost and
/// committed like any other; its commit is a PilotResult.
constexpr bool is_pilot(const TileSpec& tile) { return tile == TileSpec{}; }

struct PilotResult {
  PilotReport report;      // the same whoever computed it
  double cpu_seconds = 0;  // of the worker's threads
};

/// Largest accepted encoded result, bytes.
inline constexpr size_t kMaxPilotResultBytes = kMaxPilotBytes + 256;

std::string encode_pilot(const PilotResult& result);
/// Throws Error(kUsage) if the bytes are no such result, are too many, or a value is out of range.
PilotResult decode_pilot(const std::string& bytes);

}  // namespace lightmill
