#include "client/follow.h"

#include <cstdio>

#include "client/options.h"
#include "client/progress.h"
#include "common/error.h"

namespace lightmill::client {

JobStatus follow(FarmClient& farm, const JobId& id, bool quiet) {
  Progress progress(quiet);
  JobStatus last = farm.watch(
      id, [&](const JobStatus& status) { progress.update(status); },
      [&](const std::string& message) {
        if (!quiet) print_warning(message);
      });
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

void fetch_to_file(FarmClient& farm, const JobId& id, const std::string& path, bool half, bool quiet) {
  FetchedImage fetched = farm.fetch(id);
  write_image(fetched.image, path, {half, std::move(fetched.metadata)});
  if (!quiet) std::fprintf(stderr, "wrote %s\n", path.c_str());
}

}  // namespace lightmill::client
