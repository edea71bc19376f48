#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/statistical/agreement/agreement_matrix.h"
#include "tests/support/base64.h"

namespace lightmill::test {
namespace {

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Lightmill: agreement of strategies</title>
<style>
:root { color-scheme: light dark; --line: #8884; }
body { font: 14px/1.4 system-ui, sans-serif; margin: 1.5rem; }
table { border-collapse: collapse; margin: .5rem 0 1.5rem; }
th, td { padding: .15rem .6rem; border-bottom: 1px solid var(--line); text-align: right;
  font-variant-numeric: tabular-nums; }
th { font-weight: normal; }
.FAIL { color: #d33; font-weight: bold; }
img { width: 64px; height: 64px; image-rendering: pixelated; display: block; }
</style>
<h1>Agreement of strategies</h1>
<p>Per scene and number of vertices of a path, every estimator that can make all such paths against every other:
z of the block of 8&times;8 pixels and the channel that differ most (hover: noise of the difference). (s,t) is the
strategy alone, without weights; pt, lt and bdpt have theirs. "notices" is the error that the comparison finds.</p>
)";

std::string format(const char* text, double x) {
  char out[64];
  std::snprintf(out, sizeof out, text, x);
  return out;
}

double mean_of(const Image& image) {
  double sum = 0;
  for (const float x : image.data) sum += x;
  return sum / static_cast<double>(image.data.size());
}

/// The picture, exposed so that `mean` is a middle grey.
std::string picture(Image image, double mean) {
  const double exposure = mean > 0 ? 0.18 / mean : 1;
  for (float& x : image.data) x = static_cast<float>(std::min(x * exposure, 1.0));
  return "<img alt=\"\" src=\"data:image/png;base64," + base64(encode_png(image)) + "\">";
}

}  // namespace

std::string matrix_text(const PathLength& length, const Matrix& m, double worst_allowed) {
  std::string out;
  for (size_t i = 0; i < length.estimators.size(); ++i) {
    char line[96];
    std::snprintf(line, sizeof line, "  %d vertices  %-6s %11.5g  notices %5.1f %%  ", length.vertices,
                  length.estimators[i].name.c_str(), mean_of(length.estimators[i].picture),
                  100 * m.notices[i]);
    out += line;
    for (const Cell& cell : m.cells[i])
      out += format(std::fabs(cell.z) > worst_allowed ? " %5.1f!" : " %5.1f ", cell.z);
    out += '\n';
  }
  return out;
}

std::string matrix_html(const std::vector<SceneEstimates>& scenes, double level) {
  std::string out = kHead;
  const double allowed = largest_z(level);
  out += "<p>Largest |z| allowed: " + format("%.2f", allowed) + ".</p>\n";
  for (const SceneEstimates& s : scenes) {
    out += "<h2>" + s.scene.name + "</h2>\n";
    for (const PathLength& length : s.lengths) {
      const Matrix m = compare(length, level);
      out += "<table><tr><th>" + std::to_string(length.vertices) +
             " vertices</th><th></th><th>mean</th><th>notices</th>";
      for (const Estimator& e : length.estimators) out += "<th>" + e.name + "</th>";
      out += "</tr>\n";
      const double mean = mean_of(length.estimators[0].picture);
      for (size_t i = 0; i < length.estimators.size(); ++i) {
        const Estimator& e = length.estimators[i];
        out += "<tr><th>" + e.name + "</th><td>" + picture(e.picture, mean) + "</td><td>" +
               format("%.5g", mean_of(e.picture)) + "</td><td>" + format("%.1f %%", 100 * m.notices[i]) +
               "</td>";
        for (const Cell& cell : m.cells[i]) {
          out += std::string("<td") + (std::fabs(cell.z) > allowed ? " class=FAIL" : "") + " title=\"noise " +
                 format("%.2f %%", 100 * cell.noise) + "\">" + format("%.1f", cell.z) + "</td>";
        }
        out += "</tr>\n";
      }
      out += "</table>\n";
    }
  }
  return out + "</html>\n";
}

std::string matrix_json(const std::vector<SceneEstimates>& scenes, double level) {
  nlohmann::json all = nlohmann::json::array();
  for (const SceneEstimates& s : scenes) {
    for (const PathLength& length : s.lengths) {
      const Matrix m = compare(length, level);
      nlohmann::json rows = nlohmann::json::array();
      for (size_t i = 0; i < length.estimators.size(); ++i) {
        nlohmann::json z = nlohmann::json::array();
        for (const Cell& cell : m.cells[i]) z.push_back(cell.z);
        rows.push_back({{"estimator", length.estimators[i].name},
                        {"mean", mean_of(length.estimators[i].picture)},
                        {"notices", m.notices[i]},
                        {"z", z}});
      }
      all.push_back({{"scene", s.scene.name}, {"vertices", length.vertices}, {"rows", rows}});
    }
  }
  return nlohmann::json{{"largest_z", largest_z(level)},
                        {"nonfinite",
                         [&] {
                           uint64_t n = 0;
                           for (const auto& s : scenes) n += s.nonfinite;
                           return n;
                         }()},
                        {"matrices", all}}
      .dump(2);
}

}  // namespace lightmill::test
