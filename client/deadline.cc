#include "client/deadline.h"

#include <cstdio>
#include <ctime>

#include "client/frames.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

constexpr double kDaySeconds = 86400;

Error bad_deadline(const std::string& text, const std::string& why) {
  return {ErrorKind::kUsage, "--by " + text + ": " + why};
}

std::tm local_time(double seconds) {
  const auto whole = static_cast<std::time_t>(seconds);
  std::tm parts{};
  localtime_r(&whole, &parts);
  return parts;
}

/// Whether the parts are a time of day and a date as they stand.
bool is_time(const std::tm& parts) {
  std::tm same = parts;
  same.tm_isdst = -1;
  if (std::mktime(&same) == -1) return false;
  return same.tm_mon == parts.tm_mon && same.tm_mday == parts.tm_mday && same.tm_min == parts.tm_min &&
         parts.tm_hour >= 0 && parts.tm_hour < 24 && parts.tm_min >= 0 && parts.tm_min < 60;
}

}  // namespace

double parse_deadline(const std::string& text, double now) {
  if (text.starts_with("+")) return now + parse_duration(text.substr(1), "--by");
  std::tm parts = local_time(now);
  parts.tm_sec = 0;
  parts.tm_isdst = -1;
  int end = -1;
  const bool of_day = std::sscanf(text.c_str(), "%2d:%2d%n", &parts.tm_hour, &parts.tm_min, &end) == 2 &&
                      end == static_cast<int>(text.size());
  if (!of_day) {
    end = -1;
    const int found = std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d%n", &parts.tm_year, &parts.tm_mon,
                                  &parts.tm_mday, &parts.tm_hour, &parts.tm_min, &end);
    if (found != 5 || end != static_cast<int>(text.size())) {
      throw bad_deadline(text, "expected a time such as +90m, 18:30 or 2026-12-24T18:30");
    }
    parts.tm_year -= 1900;
    parts.tm_mon -= 1;
  }
  if (!is_time(parts)) throw bad_deadline(text, "there is no such time");
  auto at = static_cast<double>(std::mktime(&parts));
  if (of_day && at <= now) at += kDaySeconds;
  if (at <= now) throw bad_deadline(text, "it is past");
  return at;
}

}  // namespace lightmill::client
