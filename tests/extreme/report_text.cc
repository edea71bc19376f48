#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/extreme/report.h"

namespace lightmill::test {
namespace {

std::string padded(const std::string& s, size_t width) {
  return s.size() < width ? s + std::string(width - s.size(), ' ') : s;
}

constexpr size_t kName = 36, kParameter = 28, kRun = 28;

}  // namespace

std::string text_head() {
  char figures[160];
  std::snprintf(figures, sizeof figures, "%13s %13s %9s %7s %9s %9s %5s  ", "oracle", "measured", "std.err.",
                "z", "effective", "spp", "nonf.");
  return padded("case", kName) + ' ' + padded("parameter", kParameter) + ' ' + padded("strategies", kRun) +
         ' ' + figures + "verdict";
}

std::string text_row(const Row& row) {
  char figures[160] = "";
  if (row.verdict == Verdict::kSkip) {
    std::snprintf(figures, sizeof figures, "%13s %13s %9s %7s %9s %9s %5s  ", "-", "-", "-", "-", "-", "-",
                  "-");
  } else {
    std::snprintf(figures, sizeof figures, "%13.7g %13.7g %9.2g %7.2f %9.0f %9lld %5llu  ", row.m.exact,
                  row.m.measured, row.m.standard_error, row.m.z, row.m.effective_samples,
                  static_cast<long long>(row.spp), static_cast<unsigned long long>(row.m.nonfinite));
  }
  std::string line = padded(row.subject->name, kName) + ' ' + padded(row.subject->parameter, kParameter) +
                     ' ' + padded(row.run.name, kRun) + ' ' + figures + verdict_name(row.verdict);
  if (!row.note.empty()) line += ": " + row.note;
  return line;
}

std::string text_summary(const std::vector<Row>& rows) {
  std::string line;
  for (const Verdict v : {Verdict::kPass, Verdict::kNoisy, Verdict::kSkip, Verdict::kKnown, Verdict::kFail}) {
    size_t n = 0;
    for (const Row& row : rows) n += row.verdict == v;
    if (!line.empty()) line += ", ";
    line += std::to_string(n);
    line += ' ';
    line += verdict_name(v);
  }
  return line;
}

std::string json_report(const std::vector<Row>& rows) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Row& row : rows) {
    out.push_back({{"case", row.subject->name},
                   {"parameter", row.subject->parameter},
                   {"strategies", row.run.name},
                   {"formula", row.subject->oracle},
                   {"oracle", row.m.exact},
                   {"measured", row.m.measured},
                   {"standard_error", row.m.standard_error},
                   {"z", row.m.z},
                   {"effective_samples", row.m.effective_samples},
                   {"spp", row.spp},
                   {"nonfinite", row.m.nonfinite},
                   {"verdict", verdict_name(row.verdict)},
                   {"note", row.note}});
  }
  return out.dump(1) + '\n';
}

}  // namespace lightmill::test
