#pragma once
// --by: when a job is to be done.
#include <string>

namespace lightmill::client {

/// Seconds since 1970 of "+90m" (from now), "18:30" (the next one, local time) or "2026-12-24T18:30" (local
/// time). `now` in seconds since 1970. Throws Error(kUsage) for anything else, and for a time that is past.
double parse_deadline(const std::string& text, double now);

}  // namespace lightmill::client
