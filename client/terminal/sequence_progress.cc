#include "client/terminal/sequence_progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/terminal/progress.h"
#include "client/terminal/terminal.h"

namespace lightmill::client {
namespace {

constexpr double kSequenceBarSeconds = 0.2, kSequenceLineSeconds = 5;
constexpr int kSequenceBarWidth = 24;

std::string number_text(const char* form, double value) {
  char text[64];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

double sequence_fraction(const SequenceStatus& s) {
  if (s.state == JobState::kDone) return 1;
  if (s.frame_count == 0) return 0;
  // Packets say nothing where frames end by time or error: their totals have no bound then.
  const double frames =
      static_cast<double>(s.frames[static_cast<int>(JobState::kDone)]) / static_cast<double>(s.frame_count);
  const double packets =
      s.packets_total > 0 ? static_cast<double>(s.packets_done) / static_cast<double>(s.packets_total) : 0;
  return std::clamp(std::max(frames, packets), 0.0, 1.0);
}

}  // namespace

std::string sequence_line(const SequenceStatus& s) {
  std::string line = std::to_string(s.frames[static_cast<int>(JobState::kDone)]) + " of " +
                     std::to_string(s.frame_count) + " frames";
  for (const JobState state : {JobState::kFailed, JobState::kCancelled, JobState::kPaused}) {
    const int64_t count = s.frames[static_cast<int>(state)];
    if (count > 0) line += ", " + std::to_string(count) + " " + job_state_name(state);
  }
  line += number_text("  %.0f %%", std::floor(100 * sequence_fraction(s)));
  if (s.samples_per_second > 0) line += "  " + short_number(s.samples_per_second) + "samples/s";
  if (s.relmse_mean) line += number_text("  relMSE %.3g", *s.relmse_mean);
  if (s.relmse_max && s.frame_count > 1) line += number_text(", at most %.3g", *s.relmse_max);
  if (is_final(s.state)) {
    line += std::string("  ") + job_state_name(s.state) + " after " + duration_text(s.cpu_seconds) +
            " of processors";
  } else {
    if (s.eta_seconds >= 0) line += "  ETA " + duration_text(s.eta_seconds);
    if (s.workers > 0) line += "  " + std::to_string(s.workers) + (s.workers == 1 ? " worker" : " workers");
    if (s.state != JobState::kRunning) line += std::string("  ") + job_state_name(s.state);
  }
  return line;
}

SequenceProgress::SequenceProgress(bool quiet) : quiet_(quiet), terminal_(is_terminal(stderr)) {}

void SequenceProgress::update(const SequenceStatus& status) {
  if (quiet_) return;
  const auto now = std::chrono::steady_clock::now();
  const double since = std::chrono::duration<double>(now - last_time_).count();
  const double spacing = terminal_ ? kSequenceBarSeconds : kSequenceLineSeconds;
  if (drawn_ && status.state == last_state_ && since < spacing) return;
  last_time_ = now;
  draw(status);
}

void SequenceProgress::finish(const SequenceStatus& status) {
  if (quiet_) return;
  draw(status);
  if (terminal_) std::fputc('\n', stderr);
}

void SequenceProgress::draw(const SequenceStatus& status) {
  drawn_ = true;
  last_state_ = status.state;
  if (status.message != last_message_ && !status.message.empty() && !is_final(status.state)) {
    std::fprintf(stderr, "%ssequence %s: %s%s\n", terminal_ ? "\r" : "", status.id.value.c_str(),
                 status.message.c_str(), terminal_ ? "\033[K" : "");
  }
  last_message_ = status.message;
  const std::string line = sequence_line(status);
  if (!terminal_) {
    if (line != last_) std::fprintf(stderr, "%s\n", line.c_str());
    last_ = line;
    return;
  }
  std::string bar = bar_text(sequence_fraction(status), kSequenceBarWidth) + " " + line;
  const auto width = static_cast<size_t>(terminal_columns(stderr) - 1);
  if (bar.size() > width) bar.resize(width);
  std::fprintf(stderr, "\r%s\033[K", bar.c_str());
  std::fflush(stderr);
}

}  // namespace lightmill::client
