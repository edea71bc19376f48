#pragma once
// The report's section on a pilot.
#include <string>

#include "common/job/pilot_report.h"

namespace lightmill {

/// HTML: the chosen plan, its predicted gain, and the table of estimates, the chosen one first.
std::string pilot_section(const PilotReport& report);

}  // namespace lightmill
