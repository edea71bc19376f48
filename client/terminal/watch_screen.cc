#include "client/terminal/watch_screen.h"

#include <algorithm>
#include <cstdio>

#include "client/terminal/progress.h"
#include "client/terminal/terminal.h"
#include "common/film/dropped_text.h"

namespace lightmill::client {
namespace {

constexpr const char* kBold = "1";
constexpr const char* kGreen = "32";
constexpr const char* kYellow = "33";
constexpr const char* kRed = "31";
constexpr const char* kDim = "2";

const char* colour_of(JobState state) {
  switch (state) {
    case JobState::kDone:
      return kGreen;
    case JobState::kFailed:
    case JobState::kCancelled:
      return kRed;
    case JobState::kPaused:
      return kYellow;
    default:
      return kBold;
  }
}

std::string error_line(const JobStatus& s) {
  const double target = s.settings.target_error;
  std::string line = "error    ";
  if (!s.relmse) return line + "from 32 spp on";
  line += "relMSE " + format("%.3g", *s.relmse);
  if (s.relmse_low && s.relmse_high) {
    line += "  95 %: " + format("%.3g", *s.relmse_low) + " to " + format("%.3g", *s.relmse_high);
  }
  if (s.denoised_relmse) line += "  denoised " + format("%.3g", *s.denoised_relmse);
  if (target > 0) line += "  target " + target_text(s.settings);
  return line;
}

/// The text's first `columns` characters, not bytes.
std::string cut(const std::string& text, int columns) {
  int characters = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool begins = (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80;
    if (begins && characters++ == columns) return text.substr(0, i);
  }
  return text;
}

}  // namespace

std::vector<std::string> watch_lines(const JobStatus& s, const std::vector<WorkerStatus>& workers,
                                     int columns, int rows, bool colour) {
  std::vector<std::string> lines;
  const auto add = [&](const std::string& text, const char* sgr = nullptr) {
    const std::string line = cut(text, columns);
    lines.push_back(sgr ? coloured(line, sgr, colour) : line);
  };
  add("job      " + s.id.value + "  " + s.name + "  " + job_state_name(s.state) +
          (s.message.empty() ? "" : ": " + s.message),
      colour_of(s.state));
  std::string progress = bar_text(fraction_done(s), std::clamp(columns - 40, 8, 50)) + " " +
                         format("%3.0f %%", 100 * fraction_done(s)) + "  " + duration_text(s.wall_seconds);
  if (!is_final(s.state) && s.eta_seconds >= 0) progress += "  ETA " + duration_text(s.eta_seconds);
  add(progress);
  std::string samples = "samples  " + format("%.4g", s.spp);
  if (s.settings.spp < kMaxSpp) samples += " of " + std::to_string(s.settings.spp);
  samples += " per pixel";
  if (s.samples_per_second > 0) samples += "  " + short_number(s.samples_per_second) + "samples/s";
  add(samples);
  const bool met = target_met(s).value_or(false);
  add(error_line(s), met ? kGreen : nullptr);
  if (const std::string scales = scales_text(s); !scales.empty()) add("scales   " + scales);
  add("tiles    " + std::to_string(s.tiles_committed) + " merged, " + std::to_string(s.tiles_leased) +
      " out, leases reassigned " + std::to_string(s.leases_reassigned));
  for (const DroppedLine& line : dropped_lines(s.dropped, s.counters.nonfinite))
    add("dropped  " + line.text, line.warning ? kRed : kDim);
  std::vector<WorkerStatus> active;
  for (const WorkerStatus& w : workers) {
    if (w.state == "rendering" || w.state == "draining") active.push_back(w);
  }
  std::stable_sort(active.begin(), active.end(), [](const WorkerStatus& a, const WorkerStatus& b) {
    return a.samples_per_second > b.samples_per_second;
  });
  add("workers  " + std::to_string(s.workers) + " on this job, " + std::to_string(active.size()) +
      " rendering, " + std::to_string(workers.size()) + " known");
  for (const WorkerStatus& w : active) {
    if (lines.size() + 1 >= static_cast<size_t>(std::max(rows, 1))) break;
    add("         " + w.id.value + "  " + w.registration.host + "  " +
            std::to_string(w.registration.threads) + " threads  " + short_number(w.samples_per_second) +
            "samples/s  " + std::to_string(w.tiles_committed) + " tiles",
        kDim);
  }
  return lines;
}

void WatchScreen::update(const JobStatus& status, const std::vector<WorkerStatus>& workers) {
  std::string text;
  if (drawn_ > 0) text += "\033[" + std::to_string(drawn_) + "A";
  const auto lines = watch_lines(status, workers, terminal_columns(stderr) - 1, terminal_rows(stderr) - 1,
                                 has_colour(stderr));
  for (const std::string& line : lines) text.append("\r").append(line).append("\033[K\n");
  text += "\033[J";
  drawn_ = lines.size();
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace lightmill::client
