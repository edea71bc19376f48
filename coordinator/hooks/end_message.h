#pragma once
#include <optional>

#include "coordinator/core/farm.h"
#include "coordinator/hooks/hook.h"

namespace lightmill {

/// What hooks are told of the end of a job or sequence: {"type": "job.done", "timestamp": ..., "data": ...},
/// where data is JobStatus or SequenceStatus of proto/lightmill/v1 as the HTTP API has it. `unix_seconds`: of
/// now. Empty if it goes on again.
std::optional<HookMessage> end_message(const Farm& farm, const EndNote& note, int64_t unix_seconds);

}  // namespace lightmill
