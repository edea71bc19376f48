#pragma once
// --plan FILE: a sampling plan out of what earlier renders wrote down.
#include <string>

#include "common/job/sampling_plan.h"

namespace lightmill::client {

/// Reads a plan (plan.json of a report, or a bare plan), a pilot's report, the record of a job (`job --json`,
/// `render --json`) or the metadata of an .exr image. Throws Error(kUsage), naming the file, if it holds no
/// plan, and Error(kFailed) if it can't be read.
SamplingPlan read_plan(const std::string& path);

}  // namespace lightmill::client
