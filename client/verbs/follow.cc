#include "client/verbs/follow.h"

#include <chrono>
#include <cstdio>
#include <optional>

#include "client/options.h"
#include "client/output.h"
#include "client/terminal/live_view.h"
#include "client/terminal/progress.h"
#include "client/terminal/terminal.h"
#include "client/terminal/watch_screen.h"
#include "common/base/error.h"

namespace lightmill::client {

namespace {

constexpr double kScreenSeconds = 0.5;

/// The screen of watch: asks for the workers as well, twice a second at most.
class ScreenFeed {
 public:
  explicit ScreenFeed(FarmClient& farm) : farm_(farm) {}
  void update(const JobStatus& status, bool now) {
    const auto time = std::chrono::steady_clock::now();
    if (!now && std::chrono::duration<double>(time - last_).count() < kScreenSeconds) return;
    last_ = time;
    try {
      workers_ = farm_.workers();
    } catch (const Error&) {  // the stream of statuses says when the coordinator is gone
    }
    screen_.update(status, workers_);
  }

 private:
  FarmClient& farm_;
  WatchScreen screen_;
  std::vector<WorkerStatus> workers_;
  std::chrono::steady_clock::time_point last_;
};

/// Says what light the image of a job that is done lacks.
void warn_of_missing_light(const JobStatus& last) {
  if (last.state != JobState::kDone) return;
  for (const std::string& line : last.missing_light) print_warning("warning: " + line);
}

}  // namespace

JobStatus follow(FarmClient& farm, const JobId& id, bool quiet, const std::string& display, bool screen) {
  Progress progress(quiet);
  std::optional<ScreenFeed> feed;
  if (screen && !quiet && is_terminal(stderr)) feed.emplace(farm);
  std::optional<LiveView> view;
  if (!display.empty()) {
    view.emplace(
        display, id.value, [&] { return farm.fetch(id, false, 0, true).image; }, print_warning);
  }
  JobStatus last = farm.watch(
      id,
      [&](const JobStatus& status) {
        if (feed) {
          feed->update(status, is_final(status.state));
        } else {
          progress.update(status);
        }
        if (view) view->changed();
      },
      [&](const std::string& message) {
        if (!quiet) print_warning(message);
      });
  if (view) view->finish();
  if (feed) {
    feed->update(last, true);
    const std::string note = target_note(last);
    if (!note.empty()) print_warning(note);
  } else {
    progress.finish(last);
    print_dropped(last, quiet);  // the screen has said it
  }
  if (!quiet) warn_of_missing_light(last);
  if (last.state == JobState::kFailed) {
    throw Error(ErrorKind::kFailed, "job " + id.value + " failed: " + last.message);
  }
  if (last.state == JobState::kCancelled) {
    throw Error(ErrorKind::kFailed, "job " + id.value + " was cancelled; lightmill retry " + id.value +
                                        " goes on from where it stopped");
  }
  return last;
}

FetchedImage fetch_to_file(FarmClient& farm, const JobId& id, const OutputOptions& output, bool quiet,
                           int max_side, std::optional<DenoiseFigures>* denoised) {
  const bool layers = (is_exr(output.path) || output.denoise) && max_side == 0;
  FetchedImage fetched = farm.fetch(id, layers, max_side, is_png(output.path) && !output.denoise);
  const std::optional<DenoiseFigures> figures =
      write_picture(output, fetched.image, fetched.aovs, fetched.metadata, id.value, 0, quiet);
  if (figures && !quiet) std::fprintf(stderr, "denoised: %s\n", denoise_line(*figures).c_str());
  if (!quiet) std::fprintf(stderr, "wrote %s\n", output.path.c_str());
  if (denoised) *denoised = figures;
  return fetched;
}

}  // namespace lightmill::client
