#pragma once
// The report's section on the error at several scales.
#include <string>

#include "common/error/error_curve.h"

namespace lightmill {

/// HTML: a table of relMSE of pixels and of means over boxes, with how to read it. Empty where no box has
/// any.
std::string scales_section(const ErrorPoint& point);

}  // namespace lightmill
