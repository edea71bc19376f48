#pragma once
// The farm's metrics in Prometheus' text format, version 0.0.4.
#include <string>

#include "coordinator/farm.h"

namespace lightmill {

std::string metrics_text(const Farm& farm);

}  // namespace lightmill
