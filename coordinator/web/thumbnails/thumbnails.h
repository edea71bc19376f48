#pragma once
// Thumbnails of jobs, for lists: made once a job has ended, and seldom while it is rendered, by one thread.
// So a list of a hundred jobs costs no film, and a browser never waits for one. Thread-safe.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "coordinator/core/farm.h"
#include "coordinator/web/thumbnails/thumbnail_store.h"

namespace lightmill {

class Thumbnails {
 public:
  static constexpr int kSide = 96;  // pixels of the longer side
  /// Keeps them in `folder` (ThumbnailStore).
  Thumbnails(const Farm& farm, const std::string& folder, std::function<void(const std::string&)> log);
  ~Thumbnails();
  Thumbnails(const Thumbnails&) = delete;
  Thumbnails& operator=(const Thumbnails&) = delete;

  struct Answer {
    ThumbnailStore::Thumbnail thumbnail;
    bool current = true;  // it shows all that the job has
  };
  /// The newest that there is; empty: none yet. Where it is not current, one will be made before long. Throws
  /// UnknownJob.
  std::optional<Answer> get(const JobId& job);

 private:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr size_t kMostWanted = 256;  // further ones are asked for again
  void run();
  /// Jobs that have ended since the last look.
  void look_for_ended();
  void make(const JobId& job);
  void want(const JobId& job);

  const Farm& farm_;
  ThumbnailStore store_;
  uint64_t seen_ = 0;  // version of the farm at the last look; of the thread alone
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::deque<JobId> wanted_;          // the newest last: it is what somebody looks at
  std::map<JobId, Time> not_before_;  // of jobs whose thumbnail was made, or failed, lately
  std::thread thread_;
};

}  // namespace lightmill
