#pragma once
// Pictures of jobs with their light groups mixed anew, for those who look. The light of each group is read
// from the film by one thread, seldom, and kept; from that a mix is made in a moment. Nobody waits for the
// film: the answer is what there is. Thread-safe.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "common/image/light_groups/light_factor.h"
#include "coordinator/core/farm.h"
#include "coordinator/web/denoised/wishes.h"

namespace lightmill {

/// The light of a job's groups at one time.
struct MixedLight {
  ChannelImage light;  // Film::light_groups_for_display
  LightGroups groups;
  int block = 1;     // a pixel is the mean of so many by so many of the job's image
  std::string mark;  // film_mark() of what it shows
  /// The same with at most kSmallMix pixels a side, which is mixed much sooner; without pixels if it has no
  /// more.
  ChannelImage small;
};

/// What the dashboard asks for while a slider moves.
inline constexpr int kSmallMix = 800;

/// The image, each group times its factor, at low priority. `factors` are in the order of the groups; where
/// all of a channel are 1 it is the image as it was rendered. It may be larger than `side` pixels, which the
/// caller wants of it (0: all), where that does not save time.
Image mixed_image(const MixedLight& light, std::span<const LightFactor> factors, int side = 0);

class LightMixes {
 public:
  /// A mix of this many pixels takes some hundredths of a second; it is bounded by the values of all groups
  /// together, too: 4 bytes each.
  static constexpr int64_t kMostPixels = 2'500'000, kMostValues = 32'000'000;
  /// Kept of all jobs together, unless one alone has more.
  static constexpr size_t kMostBytes = size_t{256} << 20;
  /// `farm` must outlive this object.
  explicit LightMixes(const Farm& farm, int64_t most_pixels = kMostPixels, size_t most_bytes = kMostBytes);
  ~LightMixes();
  LightMixes(const LightMixes&) = delete;
  LightMixes& operator=(const LightMixes&) = delete;

  struct Answer {
    std::shared_ptr<const MixedLight> light;
    bool current = true;  // it shows all that the job has
  };
  /// The newest that there is; empty: none yet. Where it is not current, it will be read anew before long.
  /// `job`: the present status of a job that has light groups.
  std::optional<Answer> get(const JobStatus& job);

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::shared_ptr<const MixedLight> light;
    Clock::time_point next;  // not read again before
    uint64_t used = 0;       // turn of its last use
  };
  void run();
  /// Returns when the next job may be read.
  Clock::time_point read(const JobId& job);
  void keep(const JobId& job, std::shared_ptr<const MixedLight> light, Clock::time_point next);

  const Farm& farm_;
  const int64_t most_pixels_;
  const size_t most_bytes_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  Wishes wishes_;
  std::map<JobId, Kept> kept_;
  uint64_t uses_ = 0;
  std::thread thread_;
};

}  // namespace lightmill
