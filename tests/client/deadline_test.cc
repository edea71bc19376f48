// --by: times of day, dates, and times from now.
#include "client/deadline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>

#include "common/base/error.h"

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;

double local(int year, int month, int day, int hour, int minute) {
  std::tm parts{};
  parts.tm_year = year - 1900;
  parts.tm_mon = month - 1;
  parts.tm_mday = day;
  parts.tm_hour = hour;
  parts.tm_min = minute;
  parts.tm_isdst = -1;
  return static_cast<double>(std::mktime(&parts));
}

TEST(Deadline, TimesOfDayDatesAndFromNow) {
  const double noon = local(2026, 11, 28, 12, 0);
  EXPECT_EQ(parse_deadline("+90m", noon), noon + 5400);
  EXPECT_EQ(parse_deadline("18:30", noon), local(2026, 11, 28, 18, 30));
  EXPECT_EQ(parse_deadline("09:05", noon), local(2026, 11, 28, 9, 5) + 86400) << "tomorrow";
  EXPECT_EQ(parse_deadline("2026-12-24T18:30", noon), local(2026, 12, 24, 18, 30));
  for (const char* bad : {"", "soon", "25:00", "12:60", "2026-02-30T10:00", "2026-13-01T10:00", "18:30x", "+",
                          "+0", "2025-01-01T00:00", "-1h", "18.30"}) {
    try {
      parse_deadline(bad, noon);
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::kUsage) << bad;
      EXPECT_THAT(e.what(), HasSubstr("--by")) << bad;
    }
  }
}

}  // namespace
}  // namespace lightmill::client
