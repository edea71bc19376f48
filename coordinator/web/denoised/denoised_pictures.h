#pragma once
// Denoised pictures of jobs, for those who look: made one at a time, by a thread of low priority that takes a
// quarter of one processor at most. Nobody waits for one: the answer is what there is. Thread-safe.
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "coordinator/core/farm.h"
#include "coordinator/web/denoised/denoised_picture.h"
#include "coordinator/web/denoised/wishes.h"
#include "coordinator/web/pictures.h"

namespace lightmill {

class DenoisedPictures {
 public:
  /// Of larger images the time, 10 s for a million pixels, and the memory, 600 bytes a pixel, are too much.
  static constexpr int64_t kMostPixels = 2'500'000;
  /// `pictures` keeps the images. Both must outlive this object.
  DenoisedPictures(const Farm& farm, Pictures& pictures, int64_t most_pixels = kMostPixels);
  /// Stops the one in the making.
  ~DenoisedPictures();
  DenoisedPictures(const DenoisedPictures&) = delete;
  DenoisedPictures& operator=(const DenoisedPictures&) = delete;

  struct Answer {
    DenoisedPicture picture;
    std::string mark;     // film_mark() of what it shows
    bool current = true;  // it shows all that the job has
  };
  /// The newest that there is; empty: none yet. Where it is not current, one will be made before long. Throws
  /// UnknownJob.
  std::optional<Answer> get(const JobId& job);

 private:
  using Clock = std::chrono::steady_clock;
  struct Made {
    DenoisedPicture figures;  // without its image
    std::string mark;
    std::weak_ptr<const Image> image;  // Pictures has it
  };
  void run();
  /// Returns when the next one may be begun.
  Clock::time_point make(const JobId& job);
  void keep(const JobId& job, const std::string& mark, DenoisedPicture picture);

  const Farm& farm_;
  Pictures& pictures_;
  const int64_t most_pixels_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Wishes wishes_;
  std::map<JobId, Made> made_;
  std::thread thread_;
};

}  // namespace lightmill
