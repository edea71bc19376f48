#include "client/terminal/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/terminal/terminal.h"
#include "common/film/dropped_text.h"

namespace lightmill::client {
namespace {

constexpr double kBarSeconds = 0.1;   // between redraws on a terminal
constexpr double kLineSeconds = 2.0;  // between lines in a log
constexpr int kBarWidth = 24;

}  // namespace

double fraction_done(const JobStatus& status) {
  if (status.state == JobState::kDone) return 1;
  double fraction = status.packets_total > 0
                        ? static_cast<double>(status.packets_done) / static_cast<double>(status.packets_total)
                        : 0;
  if (status.settings.time_s > 0) fraction = std::max(fraction, status.wall_seconds / status.settings.time_s);
  // Samples that a target error costs grow in inverse proportion to it.
  const double target = status.settings.target_error;
  const TargetEstimate estimate = target_estimate(status);
  const std::optional<double>& error = estimate.high ? estimate.high : estimate.relmse;
  if (target > 0 && error && *error > 0) fraction = std::max(fraction, target / *error);
  return std::clamp(fraction, 0.0, 1.0);
}

std::string bar_text(double fraction, int width) {
  const auto filled = static_cast<size_t>(static_cast<double>(width) * std::clamp(fraction, 0.0, 1.0));
  std::string bar = "[";
  bar.append(filled, '#').append(static_cast<size_t>(width) - filled, '-').append(1, ']');
  return bar;
}

Phase::Phase(bool quiet, const std::string& text)
    : shown_(!quiet && is_terminal(stderr)), start_(std::chrono::steady_clock::now()) {
  if (!shown_) return;
  std::fprintf(stderr, "\r%s\033[K", text.c_str());
  std::fflush(stderr);
}

Phase::~Phase() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

void Phase::advance(const std::string& text, double fraction) {
  const auto now = std::chrono::steady_clock::now();
  if (!shown_ || std::chrono::duration<double>(now - last_).count() < kBarSeconds) return;
  last_ = now;
  const double spent = std::chrono::duration<double>(now - start_).count();
  std::string line = bar_text(fraction, kBarWidth) + " " + text;
  if (fraction > 0) line += "  ETA " + duration_text(spent * (1 - fraction) / fraction);
  std::fprintf(stderr, "\r%s\033[K", line.c_str());
  std::fflush(stderr);
}

std::string short_number(double value) {
  if (value >= 1e9) return format("%.2f G", value / 1e9);
  if (value >= 1e6) return format("%.2f M", value / 1e6);
  if (value >= 1e3) return format("%.0f k", value / 1e3);
  return format("%.0f ", value);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<int64_t>(std::llround(std::clamp(seconds, 0.0, 1e9)));
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

std::string about_text(double seconds) {
  constexpr double kMinute = 60, kHour = 3600, kDay = 86400;
  if (seconds < kMinute) return "less than a minute";
  if (seconds < 2 * kHour) return "about " + format("%.0f", seconds / kMinute) + " min";
  if (seconds < 2 * kDay) return "about " + format("%.0f", seconds / kHour) + " h";
  return "about " + format("%.0f", seconds / kDay) + " days";
}

std::string progress_line(const JobStatus& status) {
  std::string line = format("%3.0f %%", std::floor(100 * fraction_done(status)));
  line += "  " + format("%.4g", status.spp);
  if (status.settings.spp < kMaxSpp) line.append("/").append(std::to_string(status.settings.spp));
  line += " spp";
  if (status.samples_per_second > 0) line += "  " + short_number(status.samples_per_second) + "samples/s";
  if (status.relmse) {
    line += "  relMSE " + format("%.3g", *status.relmse);
    if (status.relmse_low && status.relmse_high) {
      line += " ±" + format("%.2g", (*status.relmse_high - *status.relmse_low) / 2);
    }
  }
  if (status.denoised_relmse) line += "  denoised " + format("%.3g", *status.denoised_relmse);
  const bool ended = status.state == JobState::kDone || status.state == JobState::kFailed ||
                     status.state == JobState::kCancelled;
  if (ended) {
    line += std::string("  ") + job_state_name(status.state) + " after " + duration_text(status.wall_seconds);
  } else {
    if (needs_pilot(status.settings) && status.workers > 0) line += "  choosing strategies";
    if (status.eta_seconds >= 0 && status.turn_seconds < 0)
      line += "  ETA " + duration_text(status.eta_seconds);
    if (status.state != JobState::kRunning) line += std::string("  ") + job_state_name(status.state);
  }
  return line;
}

std::string scales_text(const JobStatus& status) {
  std::string text;
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    if (!status.boxes[i].relmse) continue;
    if (!text.empty()) text += ", ";
    text += std::to_string(kBoxSides[i]) + " px " + format("%.3g", *status.boxes[i].relmse);
  }
  return text;
}

std::string waiting_note(const JobStatus& status) {
  if (is_final(status.state) || status.workers > 0 || status.message.empty()) return "";
  return "job " + status.id.value + " is " + job_state_name(status.state) + ": " + status.message;
}

std::string turn_text(const JobStatus& status) {
  if (status.turn_seconds < 0) return "";
  const std::string end = status.eta_seconds < 0 ? "" : ", done in " + about_text(status.eta_seconds);
  return "comes in " + about_text(status.turn_seconds) + end;
}

Progress::Progress(bool quiet) : quiet_(quiet), terminal_(is_terminal(stderr)) {}

void Progress::update(const JobStatus& status) {
  if (quiet_) return;
  const auto now = std::chrono::steady_clock::now();
  const double since = std::chrono::duration<double>(now - last_time_).count();
  if (drawn_ && status.state == last_state_ && since < (terminal_ ? kBarSeconds : kLineSeconds)) return;
  last_time_ = now;
  draw(status);
}

std::optional<bool> target_met(const JobStatus& status) {
  if (!(status.settings.target_error > 0)) return std::nullopt;
  const std::optional<double> high = target_estimate(status).high;
  return high && *high < status.settings.target_error;
}

TargetEstimate target_estimate(const JobStatus& status) {
  if (status.settings.target_denoised) return {status.denoised_relmse, status.denoised_relmse_high};
  return {status.relmse, status.relmse_high};
}

std::string target_text(const RenderSettings& settings) {
  return (settings.target_denoised ? "denoised:" : "") + format("%.3g", settings.target_error);
}

std::string target_note(const JobStatus& status) {
  const double target = status.settings.target_error;
  if (status.state != JobState::kDone || target_met(status).value_or(true)) return "";
  const TargetEstimate estimate = target_estimate(status);
  std::string note = "--target-error " + target_text(status.settings) + " was not reached in " +
                     duration_text(status.wall_seconds) + ", " + format("%.4g", status.spp) + " spp: ";
  if (!estimate.relmse) return note + "an estimate of the error takes 32 spp";
  note +=
      (status.settings.target_denoised ? "denoised relMSE " : "relMSE ") + format("%.3g", *estimate.relmse);
  if (!estimate.high) {
    return note +
           (status.settings.target_denoised ? ", which has no interval" : ", whose interval takes 64 spp");
  }
  note += ", 95 % sure below " + format("%.3g", *estimate.high);
  if (status.wall_seconds > 0) {
    note +=
        "; about " + duration_text(status.wall_seconds * (*estimate.high / target - 1)) + " more would do";
  }
  return note;
}

void print_dropped(const JobStatus& status, bool quiet) {
  for (const DroppedLine& line : dropped_lines(status.dropped, status.counters.nonfinite)) {
    if (line.warning) {
      std::fprintf(stderr, "lightmill: warning: %s\n", line.text.c_str());
    } else if (!quiet) {
      std::fprintf(stderr, "dropped: %s\n", line.text.c_str());
    }
  }
}

void Progress::finish(const JobStatus& status) {
  if (quiet_) return;
  draw(status);
  if (terminal_) std::fputc('\n', stderr);
  const std::string note = target_note(status);
  if (!note.empty()) std::fprintf(stderr, "lightmill: %s\n", note.c_str());
}

void Progress::draw(const JobStatus& status) {
  drawn_ = true;
  if (!named_ && status.settings.integrator == Integrator::kAuto && status.settings.plan) {
    named_ = true;
    std::fprintf(stderr, "%s%s%s\n", terminal_ ? "\r" : "", sampling_text(status.settings).c_str(),
                 terminal_ ? "\033[K" : "");
  }
  const std::string waits = waiting_note(status);
  if (waits != last_wait_ && !waits.empty())
    std::fprintf(stderr, "%s%s%s\n", terminal_ ? "\r" : "", waits.c_str(), terminal_ ? "\033[K" : "");
  last_wait_ = waits;
  last_state_ = status.state;
  std::string line = progress_line(status);
  line += "  tiles " + std::to_string(status.tiles_committed);
  if (status.workers > 0) line += ", workers " + std::to_string(status.workers);
  if (!terminal_) {
    if (line != last_) std::fprintf(stderr, "%s\n", line.c_str());
    last_ = line;
    return;
  }
  std::string bar = bar_text(fraction_done(status), kBarWidth) + " " + line;
  const auto width = static_cast<size_t>(terminal_columns(stderr) - 1);
  if (bar.size() > width) bar.resize(width);
  while (!bar.empty() && (static_cast<unsigned char>(bar.back()) & 0xC0) == 0x80) bar.pop_back();
  std::fprintf(stderr, "\r%s\033[K", bar.c_str());
  std::fflush(stderr);
}

}  // namespace lightmill::client
