#pragma once
// The last line of a program that an exception ends.
#include <exception>
#include <string>

namespace lightmill {

/// What happened and how to mend it: of the standard library's exceptions that limits of the system cause,
/// which say too little themselves; else what() as it is.
std::string error_line(const std::exception& error);

}  // namespace lightmill
