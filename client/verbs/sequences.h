#pragma once
// What verbs do with sequences: read the frames' scenes, follow them, and fetch their images.
#include <map>
#include <string>
#include <vector>

#include "client/connection/farm_client.h"
#include "client/connection/sequence_client.h"
#include "client/frames.h"
#include "client/options.h"

namespace lightmill::client {

/// What a sequence is submitted with.
struct LoadedFrames {
  std::vector<FrameRequest> frames;
  std::map<std::string, std::string> paths;  // digest -> file
};
/// Reads the scene of every frame; frames of one file differ in time alone, and it is read once. Throws as
/// load_scene_for and resolve_settings.
LoadedFrames load_frames(const SceneOptions& scene, const std::vector<SceneFrame>& frames, bool quiet);

/// Which frames of a sequence are to be fetched, and where to.
struct FrameFetch {
  OutputOptions output;  // whose path is a pattern
  std::string frames;    // as --frames; empty: all
};
/// Checks the output before anything is done: a pattern, whose images can be written.
void check_frame_output(const FrameFetch& fetch, Aovs aovs);

/// Fetches frames that are done, each once, into files. A frame's .exr that is there with the same samples is
/// left as it is.
class FrameFetcher {
 public:
  FrameFetcher(FarmClient& farm, SequenceClient& sequences, const SequenceId& id, const FrameFetch& fetch,
               bool quiet);
  /// Those that have come since the last call.
  void fetch_new();
  int written() const { return written_; }
  int left() const { return left_; }  // files that were there already

 private:
  FarmClient& farm_;
  SequenceClient& sequences_;
  const SequenceId id_;
  const FrameFetch fetch_;
  const bool quiet_;
  FramePattern pattern_;
  std::vector<int> wanted_;        // ascending; empty: all
  uint64_t seen_ = 0;              // version
  std::map<int, double> fetched_;  // samples, by frame
  int written_ = 0, left_ = 0;
};

/// Shows progress until all frames have ended; `fetcher`, if given, fetches each as it is done. Throws
/// Error(kFailed) if a frame failed or was cancelled.
SequenceStatus follow_sequence(SequenceClient& sequences, const SequenceId& id, bool quiet,
                               FrameFetcher* fetcher = nullptr);

}  // namespace lightmill::client
