#pragma once
// Frames on the command line: which ones, of which scene files, and into which image files.
#include <optional>
#include <string>
#include <vector>

#include "client/options.h"
#include "common/farm/sequence_types.h"

namespace CLI {
class App;
}

namespace lightmill::client {

/// --frames and what goes with it.
struct FrameOptions {
  std::string frames;  // as typed
  std::string order = "sequential";
  std::string quality;        // "equal", or empty
  double budget_seconds = 0;  // 0: none

  bool given() const { return !frames.empty(); }
};
void add_frames(CLI::App* verb, FrameOptions* options);

/// "90", "90s", "30m", "12h" or "2d" in seconds. Throws Error(kUsage), which names `option`, for anything
/// else.
double parse_duration(const std::string& text, const std::string& option);

/// "1-100", "1-100x2", "1-10,20,30-40x5" as numbers in the order in which they are written, each once. Throws
/// Error(kUsage) for anything else, and for more than kMaxFrames.
std::vector<int> parse_frames(const std::string& text);

/// A name with the place of a number, as printf writes it ("shot.%04d.exr") or in marks ("shot.####.exr").
class FramePattern {
 public:
  /// Empty if the name has no such place. Throws Error(kUsage) for more than one, or another conversion.
  static std::optional<FramePattern> find(const std::string& name);
  /// As find; throws Error(kUsage), which names `option`, if there is none.
  static FramePattern require(const std::string& name, const std::string& option);

  std::string name_of(int frame) const;

 private:
  std::string before_, after_;
  size_t digits_ = 0;
};

/// One frame of what is to be rendered.
struct SceneFrame {
  int number = 0;
  std::string file;            // to be loaded
  std::optional<double> time;  // in a glTF file's animation, seconds
};

/// The frames that the options ask for: of one glTF file at the times number / fps; of a name with a pattern
/// one file each; of "-" the files that `list` has, a line each, which are numbered as --frames says, or from
/// 1. Throws Error(kUsage) if there are none, or if a scene that has no animation is to have frames.
std::vector<SceneFrame> scene_frames(const SceneOptions& scene, const FrameOptions& options,
                                     std::istream& list);
/// Whether the options ask for frames: by --frames or a list. Throws Error(kUsage) for options of sequences
/// without.
bool wants_frames(const SceneOptions& scene, const FrameOptions& options);

}  // namespace lightmill::client
