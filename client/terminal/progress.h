#pragma once
// Progress of a job on stderr: a bar on a terminal, plain lines otherwise, nothing when quiet.
#include <chrono>
#include <optional>
#include <string>

#include "coordinator/core/farm.h"

namespace lightmill::client {

/// How much of the job is done, by its samples, its time or its error, whichever is nearest; in [0, 1].
double fraction_done(const JobStatus& status);

/// "37 %  24/64 spp  1.31 Msamples/s  relMSE 0.0123 (0.0101..0.0150)  ETA 12 s  3 workers"; parts that are
/// not known yet are left out.
std::string progress_line(const JobStatus& status);

/// "4 px 0.011, 16 px 0.013, 32 px 0.02": the estimated error of means over boxes of pixels; what is not
/// known is left out.
std::string scales_text(const JobStatus& status);

/// Why nobody works for a job that has not ended, one line; empty if somebody does, or nobody knows.
std::string waiting_note(const JobStatus& status);
/// "comes in about 12 min, done in about 20 min"; empty if it does not wait for its turn, or that is not
/// known.
std::string turn_text(const JobStatus& status);

/// What --target-error of the job refers to: the estimate of the raw or of the denoised image, and the upper
/// end of its interval.
struct TargetEstimate {
  std::optional<double> relmse, high;
};
TargetEstimate target_estimate(const JobStatus& status);
/// "0.01", or "denoised:0.01", as it was given.
std::string target_text(const RenderSettings& settings);
/// Whether the upper end of the error's interval is below --target-error; empty without one.
std::optional<bool> target_met(const JobStatus& status);
/// One line about a job that ended, by its time or its samples, above its target error: what was reached, and
/// what is missing. Empty if there is nothing to say.
std::string target_note(const JobStatus& status);

/// Says what the image of a job that has rendered lacks: with `quiet`, only what is worth a warning.
void print_dropped(const JobStatus& status, bool quiet);

class Progress {
 public:
  explicit Progress(bool quiet);
  /// Shows the status if enough time has passed since the last one, or if its state changed.
  void update(const JobStatus& status);
  /// Shows the last status and the note about its target, and leaves the cursor on a fresh line.
  void finish(const JobStatus& status);

 private:
  void draw(const JobStatus& status);
  bool quiet_, terminal_;
  bool drawn_ = false;
  bool named_ = false;  // what the pilot chose was shown
  std::string last_, last_wait_;
  JobState last_state_ = JobState::kQueued;
  std::chrono::steady_clock::time_point last_time_;
};

/// "[######------]", `width` characters inside.
std::string bar_text(double fraction, int width);

/// A line on a terminal that says what is being done, gone when it is done; nothing elsewhere.
class Phase {
 public:
  Phase(bool quiet, const std::string& text);
  ~Phase();
  Phase(const Phase&) = delete;
  Phase& operator=(const Phase&) = delete;
  /// Replaces the line by `text` and a bar; at most ten times a second.
  void advance(const std::string& text, double fraction);

 private:
  bool shown_;
  std::chrono::steady_clock::time_point start_, last_;
};

/// "1.31 M", "820 k", "17".
std::string short_number(double value);
/// "12 s", "3 min 5 s", "2 h 4 min".
std::string duration_text(double seconds);
/// "about 12 min", of what is only estimated: "less than a minute", then minutes, hours, days.
std::string about_text(double seconds);

}  // namespace lightmill::client
