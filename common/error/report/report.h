#pragma once
// The error-against-time report: error.csv, error.svg, a self-contained report.html, and plan.json.
#include <optional>
#include <string>
#include <vector>

#include "common/error/error_curve.h"
#include "common/film/partial.h"
#include "common/image/image.h"
#include "common/job/pilot_report.h"

namespace lightmill {

struct ReportInfo {
  std::string title;
  std::string settings_json;
  RenderCounters counters;
  std::string plan_json;                        // content of plan.json, for --plan; empty: no such file
  std::optional<PilotReport> pilot;             // shown if there was one
  std::vector<std::string> missing_light = {};  // as in JobStatus
  DroppedShares dropped = {};                   // as in JobStatus
};

/// Writes the files into `folder` (made if absent). `image` is embedded in the HTML as a PNG.
/// Throws Error(kFailed) if it can't be written.
void write_report(const std::string& folder, const ReportInfo& info, const ErrorCurve& curve,
                  const Image& image);
/// Reads error.csv of a report folder. Throws Error(kFailed) with file:line on malformed input.
ErrorCurve read_report_csv(const std::string& path);
/// The plot alone: log-log relMSE against wall seconds, intervals as bands. Several curves are told apart by
/// their job_name.
std::string error_svg(const std::vector<ErrorCurve>& curves);

}  // namespace lightmill
