#include "client/follow.h"

#include <cstdio>
#include <optional>

#include "client/live_view.h"
#include "client/options.h"
#include "client/output.h"
#include "client/progress.h"
#include "common/error.h"

namespace lightmill::client {

JobStatus follow(FarmClient& farm, const JobId& id, bool quiet, const std::string& display) {
  Progress progress(quiet);
  std::optional<LiveView> view;
  if (!display.empty()) {
    view.emplace(
        display, id.value, [&] { return farm.fetch(id).image; }, print_warning);
  }
  JobStatus last = farm.watch(
      id,
      [&](const JobStatus& status) {
        progress.update(status);
        if (view) view->changed();
      },
      [&](const std::string& message) {
        if (!quiet) print_warning(message);
      });
  if (view) view->finish();
  progress.finish(last);
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
                           int max_side) {
  FetchedImage fetched = farm.fetch(id, is_exr(output.path) && max_side == 0, max_side);
  write_image(fetched.image, output.path, {output.half, fetched.metadata, &fetched.aovs, view_of(output)});
  if (!quiet) std::fprintf(stderr, "wrote %s\n", output.path.c_str());
  return fetched;
}

}  // namespace lightmill::client
