#include "common/error/report/pilot_section.h"

#include "common/error/report/report_text.h"
#include "common/job/plan_text.h"

namespace lightmill {
namespace {

constexpr size_t kShown = 8;  // rows before the fold

std::string gain_text(const PilotReport& report, const char* name, const SamplingPlan& other) {
  const auto gain = predicted_gain(report, other);
  return gain ? ", " + short_number(*gain) + " times that of " + name : std::string();
}

std::string table(const std::vector<PlanEstimate>& list, size_t begin, size_t end) {
  std::string html =
      "<table>\n<tr><th>plan</th><th>relative variance of a sample</th><th>µs a sample</th>"
      "<th>variance × cost</th></tr>\n";
  for (size_t i = begin; i < end; ++i) {
    const PlanEstimate& e = list[i];
    html += "<tr><td>" + escape_markup(plan_text(e.plan)) + "</td><td>" + short_number(e.relative_variance) +
            "</td><td>" + short_number(e.cost) + "</td><td>" + short_number(e.relative_variance * e.cost) +
            "</td></tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

std::string pilot_section(const PilotReport& report) {
  const std::vector<PlanEstimate> list = ranked_estimates(report);
  std::string html = "<h2>Sampling plan</h2>\n<p>A pilot of " + std::to_string(report.samples) +
                     " camera paths chose " + escape_markup(plan_text(report.chosen)) +
                     ". Predicted efficiency: the best of " + std::to_string(list.size()) + " plans" +
                     gain_text(report, "path tracing", path_tracing_plan()) +
                     gain_text(report, "bdpt", SamplingPlan()) + ".";
  if (report.chosen.guided_emission.value_or(false))
    html +=
        " Emission is guided: " + short_number(report.emission_guide_gain) + " times the efficiency without.";
  if (!report.chosen.allocation.uniform()) {
    html += " Samples are spent where the image is noisy: another " + short_number(report.adaptive_gain) +
            " times.";
  }
  html += "</p>\n";
  const size_t shown = std::min(kShown, list.size());
  html += table(list, 0, shown);
  if (shown < list.size()) {
    html += "<details><summary>The other " + std::to_string(list.size() - shown) + "</summary>\n" +
            table(list, shown, list.size()) + "</details>\n";
  }
  return html;
}

}  // namespace lightmill
