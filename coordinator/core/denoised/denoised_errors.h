#pragma once
// The error that is left in jobs' images once they are denoised: estimated one at a time, by a thread of low
// priority. The caller hands over the pixels and is told of the estimate.
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "common/base/ids.h"
#include "common/error/error_curve.h"
#include "common/image/image.h"

namespace lightmill {

class DenoisedErrors {
 public:
  struct Task {
    JobId job;
    ErrorPoint point;  // of the samples that the image has
    Image image;
    ChannelImage layers;  // its AOVs, with all of kAovsToDenoise
  };
  /// Receives the point with the denoised image's error, or without it and with a reason. Called on the
  /// thread of this object, which holds no lock. What it throws is dropped.
  using Done = std::function<void(const JobId&, const ErrorPoint&, const std::string& failure)>;

  DenoisedErrors(int threads, Done done) : threads_(threads), done_(std::move(done)) {}
  /// Stops the one in the making; nobody is told of it.
  ~DenoisedErrors();
  DenoisedErrors(const DenoisedErrors&) = delete;
  DenoisedErrors& operator=(const DenoisedErrors&) = delete;

  /// Images are large: no more than two wait. Whoever finds no room comes again.
  bool has_room() const;
  void add(Task task);

 private:
  void run();

  const int threads_;
  const Done done_;
  std::stop_source stop_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;
  std::thread thread_;  // from the first task on
};

}  // namespace lightmill
