#include "client/verbs/sequences.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "client/output.h"
#include "client/terminal/progress.h"
#include "client/terminal/sequence_progress.h"
#include "client/verbs/follow.h"
#include "common/base/error.h"
#include "common/image/image.h"

namespace lightmill::client {
namespace {

/// Whether the file holds this very image of the frame: same scene, job, samples and colour space.
bool is_fetched(const std::string& path, const FrameStatus& frame, ImageSpace space) {
  if (!is_exr(path) || !std::filesystem::exists(path)) return false;
  try {
    if (read_image_metadata(path, "job") != frame.job.value) return false;
    if (read_image_metadata(path, "scene") != frame.bundle_digest) return false;
    if (read_image_space(path) != space) return false;
    const std::string text = read_image_metadata(path, "spp");
    double spp = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), spp);
    return error == std::errc() && end == text.data() + text.size() &&
           std::abs(spp - frame.spp) <= 1e-6 * frame.spp;
  } catch (const Error&) {  // it is damaged, or another program's: written anew
    return false;
  }
}

}  // namespace

LoadedFrames load_frames(const SceneOptions& options, const std::vector<SceneFrame>& frames, bool quiet) {
  LoadedFrames loaded;
  std::optional<Phase> phase;
  std::string file;  // of the frame before
  for (const SceneFrame& frame : frames) {
    FrameRequest request;
    request.number = frame.number;
    if (!loaded.frames.empty() && frame.file == file && frame.time) {
      request.bundle = loaded.frames.back().bundle;
      request.settings = loaded.frames.back().settings;
      request.bundle.pose.time = frame.time;
      loaded.frames.push_back(std::move(request));
      continue;
    }
    file = frame.file;
    SceneOptions one = options;
    one.scene = frame.file;
    one.pose.time = frame.time;
    // Files that follow each other are alike: what there is to warn of was said of the first.
    const SceneDescription scene = load_scene_for(one, quiet || !loaded.frames.empty());
    request.settings = resolve_settings(scene, one.render);
    request.bundle = make_bundle(scene, &loaded.paths);
    loaded.frames.push_back(std::move(request));
    if (frames.size() > 1) {
      const std::string text = "reading " + frame.file;
      if (!phase) phase.emplace(quiet, text);
      phase->advance(text, static_cast<double>(loaded.frames.size()) / static_cast<double>(frames.size()));
    }
  }
  return loaded;
}

void check_frame_output(const FrameFetch& fetch, Aovs aovs) {
  const FramePattern pattern = FramePattern::require(fetch.output.path, "-o");
  OutputOptions one = fetch.output;
  one.path = pattern.name_of(fetch.frames.empty() ? 1 : parse_frames(fetch.frames).front());
  check_output(one, aovs);
}

FrameFetcher::FrameFetcher(FarmClient& farm, SequenceClient& sequences, const SequenceId& id,
                           const FrameFetch& fetch, bool quiet)
    : farm_(farm),
      sequences_(sequences),
      id_(id),
      fetch_(fetch),
      quiet_(quiet),
      pattern_(FramePattern::require(fetch.output.path, "-o")) {
  if (!fetch.frames.empty()) wanted_ = parse_frames(fetch.frames);
  std::sort(wanted_.begin(), wanted_.end());
}

void FrameFetcher::fetch_new() {
  for (const FrameStatus& frame : sequences_.frames(id_, seen_)) {
    seen_ = std::max(seen_, frame.version);
    if (frame.state != JobState::kDone) continue;
    if (!wanted_.empty() && !std::binary_search(wanted_.begin(), wanted_.end(), frame.number)) continue;
    const auto known = fetched_.find(frame.number);
    if (known != fetched_.end() && known->second == frame.spp) continue;
    fetched_[frame.number] = frame.spp;
    OutputOptions one = fetch_.output;
    one.path = pattern_.name_of(frame.number);
    if (is_fetched(one.path, frame, one.space)) {
      ++left_;
      continue;
    }
    fetch_to_file(farm_, frame.job, one, quiet_);
    ++written_;
  }
}

SequenceStatus follow_sequence(SequenceClient& sequences, const SequenceId& id, bool quiet,
                               FrameFetcher* fetcher) {
  SequenceProgress progress(quiet);
  int64_t done = -1;
  const SequenceStatus last = sequences.watch(
      id,
      [&](const SequenceStatus& status) {
        progress.update(status);
        const int64_t now_done = status.frames[static_cast<int>(JobState::kDone)];
        if (fetcher && now_done != done) fetcher->fetch_new();
        done = now_done;
      },
      [&](const std::string& message) {
        if (!quiet) print_warning(message);
      });
  progress.finish(last);
  if (last.state == JobState::kFailed)
    throw Error(ErrorKind::kFailed, "sequence " + id.value + ": " + last.message);
  if (last.state == JobState::kCancelled) {
    throw Error(ErrorKind::kFailed, "frames of sequence " + id.value + " were cancelled; lightmill retry " +
                                        id.value + " goes on from where they stopped");
  }
  return last;
}

}  // namespace lightmill::client
