#include <cstdio>
#include <sstream>

#include "coordinator/http_server.h"

namespace lightmill {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string rounded(double value, const char* format) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

void row(std::ostringstream& out, std::initializer_list<std::string> cells, const char* tag = "td") {
  out << "<tr>";
  for (const std::string& cell : cells) out << '<' << tag << '>' << escaped(cell) << "</" << tag << '>';
  out << "</tr>\n";
}

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="refresh" content="3"><title>Lightmill</title>
<style>body{font:15px/1.5 system-ui,sans-serif;margin:2rem;color:#222}table{border-collapse:collapse;margin:1rem 0}
td,th{padding:.25rem .8rem;border-bottom:1px solid #ddd;text-align:left}th{color:#666;font-weight:600}</style>
</head><body><h1>Lightmill</h1>
)";

}  // namespace

std::string status_page(const Farm& farm) {
  std::ostringstream out;
  out << kHead << "<h2>Jobs</h2>\n<table>";
  row(out,
      {"job", "name", "state", "sampling", "packets", "spp", "samples/s", "relMSE", "wall s", "workers",
       "note"},
      "th");
  for (const JobStatus& job : farm.jobs()) {
    row(out, {job.id.value, job.name, job_state_name(job.state), sampling_text(job.settings),
              std::to_string(job.packets_done) + " of " + std::to_string(job.packets_total),
              rounded(job.spp, "%.1f"), rounded(job.samples_per_second, "%.3g"),
              job.relmse ? rounded(*job.relmse, "%.2e") : "", rounded(job.wall_seconds, "%.1f"),
              std::to_string(job.workers), job.message});
  }
  out << "</table>\n<h2>Workers</h2>\n<table>";
  row(out, {"worker", "host", "threads", "pool", "state", "tiles", "samples/s", "seen s ago"}, "th");
  for (const WorkerStatus& worker : farm.workers()) {
    row(out, {worker.id.value, worker.registration.host, std::to_string(worker.registration.threads),
              worker.registration.pool, worker.state, std::to_string(worker.tiles_committed),
              rounded(worker.samples_per_second, "%.3g"), rounded(worker.seconds_since_seen, "%.0f")});
  }
  out << "</table></body></html>\n";
  return out.str();
}

}  // namespace lightmill
