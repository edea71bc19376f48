#pragma once
// Pictures of jobs as browsers ask for them: many viewers share one, and it is made so seldom that commits of
// the job, which wait meanwhile, lose little. Thread-safe.
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "coordinator/core/farm.h"

namespace lightmill {

class Pictures {
 public:
  enum class Kind { kBeauty, kError };
  explicit Pictures(const Farm& farm) : farm_(farm) {}

  struct Picture {
    std::shared_ptr<const Image> image;
    bool current = true;  // the job has not changed since it was made
  };
  /// The image of a job (Farm::image), or where its noise is (Farm::error_map), at most a little old. Throws
  /// as these do.
  Picture get(const JobId& job, Kind kind);

  /// Keeps a picture that somebody else made of a job, in place of the last one, within the same bytes.
  void keep(const JobId& job, std::shared_ptr<const Image> image);
  /// What keep() was given, if it is still there.
  std::shared_ptr<const Image> kept(const JobId& job);

 private:
  static constexpr size_t kMaxBytes = size_t{256} << 20;  // kept, unless one alone is larger
  using Key = std::pair<JobId, std::optional<Kind>>;      // no kind: of keep()
  struct Slot {
    std::mutex mutex;                    // held while the picture is made: others wait and share it
    std::shared_ptr<const Image> image;  // of keep(): guarded by the mutex of all
    uint64_t version = 0;                // of the job, before the picture was made
    double next = 0;                     // not made again before this time, seconds of the steady clock
    std::size_t bytes = 0;               // guarded by the mutex of all
  };
  /// Makes it the one used last, and adds it if it is not there. Call with the mutex of all.
  std::shared_ptr<Slot>& touch(const Key& key);
  void forget_some(const Key& but);

  const Farm& farm_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<Slot>> slots_;
  std::list<Key> order_;  // least recently used first
};

/// "LMH1", width, height, channels (uint32, little endian), then the pixels as half floats, rows from the
/// top.
std::string half_picture(const Image& image);
/// "LMF1", the same head, and the values as floats: for what spans more than half floats do.
std::string float_picture(const Image& image);

/// Files of a job's image: with layers and metadata, and as it shows under a view. Temporary files' names
/// hold `name`. Throw as Farm::aovs and write_image.
std::string exr_file(const Farm& farm, const JobId& job, const std::string& name);
std::string png_file(const Image& image, const ViewTransform& view, const std::string& name);

}  // namespace lightmill
