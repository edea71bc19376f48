#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/extreme/report.h"
#include "tests/support/base64.h"

namespace lightmill::test {
namespace {

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Lightmill: stiff and extreme cases</title>
<style>
:root { color-scheme: light dark; --fail: #d33; --warn: #b80; --ok: #2a8; --line: #8884; }
body { font: 14px/1.4 system-ui, sans-serif; margin: 1.5rem; }
table { border-collapse: collapse; }
th, td { padding: .15rem .6rem; border-bottom: 1px solid var(--line); text-align: left; white-space: nowrap; }
th { position: sticky; top: 0; background: Canvas; cursor: pointer; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
.FAIL { color: var(--fail); font-weight: bold; } .noisy, .known { color: var(--warn); } .pass { color: var(--ok); }
.skip { opacity: .6; }
img { width: 48px; height: 48px; image-rendering: pixelated; display: block; }
</style>
<h1>Stiff and extreme cases</h1>
<p>Each row renders a scene whose answer is known, by one integrator or set of strategies. It fails at |z| &ge; 4,
at a non-finite contribution, or when its standard error is above 1 % without a note that says why. Channel means;
the channel that is farthest off is shown. Pictures are exposed so that the answer is middle grey.</p>
)";

constexpr const char* kTail = R"(<script>
const body = document.querySelector('tbody');
document.querySelectorAll('th').forEach((head, column) => head.addEventListener('click', () => {
  const value = row => { const d = row.cells[column].dataset.v; return d === undefined ? row.cells[column].textContent : Number(d); };
  const up = head.dataset.up = head.dataset.up === '1' ? '' : '1';
  const order = (a, b) => { const x = value(a), y = value(b); return (x < y ? -1 : x > y ? 1 : 0) * (up ? 1 : -1); };
  body.append(...[...body.rows].sort(order));
}));
</script>
</html>
)";

std::string escaped(const std::string& s) {
  std::string out;
  for (const char c : s) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

/// The picture as a data URI, its answer at middle grey (0.18 linear).
std::string data_uri(const Measurement& m) {
  Image image = m.picture;
  const double exposure = m.exact > 0 ? 0.18 / m.exact : 1;
  for (float& x : image.data) x = static_cast<float>(std::min(x * exposure, 1.0));
  return "data:image/png;base64," + base64(encode_png(image));
}

std::string number_cell(const char* format, double x) {
  char cell[128], shown[48];
  std::snprintf(shown, sizeof shown, format, x);
  std::snprintf(cell, sizeof cell, "<td class=n data-v=\"%.9g\">%s</td>", std::isfinite(x) ? x : 1e300,
                shown);
  return cell;
}

std::string table_row(const Row& row, bool picture) {
  const std::string verdict = verdict_name(row.verdict);
  std::string out = "<tr class=" + verdict + "><td>";
  if (picture) out += "<img alt=\"\" src=\"" + data_uri(row.m) + "\">";
  out += "</td><td title=\"" + escaped(row.subject->oracle) + "\">" + escaped(row.subject->name) +
         "</td><td>" + escaped(row.subject->parameter) + "</td><td>" + escaped(row.run.name) + "</td>";
  if (row.verdict == Verdict::kSkip) {
    for (int i = 0; i < 7; ++i) out += "<td class=n data-v=\"0\">&ndash;</td>";
  } else {
    out += number_cell("%.6g", row.m.exact) + number_cell("%.6g", row.m.measured) +
           number_cell("%.2g", row.m.standard_error) + number_cell("%.2f", row.m.z) +
           number_cell("%.0f", row.m.effective_samples) + number_cell("%.0f", static_cast<double>(row.spp)) +
           number_cell("%.0f", static_cast<double>(row.m.nonfinite));
  }
  return out + "<td>" + verdict + "</td><td>" + escaped(row.note) + "</td></tr>\n";
}

}  // namespace

std::string html_report(const std::vector<Row>& rows) {
  std::string out = kHead;
  out += "<p><b>" + text_summary(rows) + "</b></p>\n<table><thead><tr>";
  for (const char* head : {"picture", "case", "parameter", "strategies", "oracle", "measured", "std. error",
                           "z", "effective samples", "spp", "non-finite", "verdict", "note"})
    out += std::string("<th>") + head + "</th>";
  out += "</tr></thead><tbody>\n";
  const Case* pictured = nullptr;
  for (const Row& row : rows) {
    const bool picture = row.subject != pictured && !row.m.picture.data.empty();
    if (picture) pictured = row.subject;
    out += table_row(row, picture);
  }
  return out + "</tbody></table>\n" + kTail;
}

}  // namespace lightmill::test
