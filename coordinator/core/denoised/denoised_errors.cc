#include "coordinator/core/denoised/denoised_errors.h"

#include <exception>
#include <utility>

#include "common/image/denoise/denoise.h"
#include "common/image/denoise/layers.h"
#include "coordinator/core/low_priority.h"

namespace lightmill {
namespace {

constexpr size_t kMostTasks = 2;

/// Fills in the point. Returns why it could not; empty: it could.
std::string estimate(DenoisedErrors::Task* task, int threads, const std::stop_token& stop) {
  try {
    // The threads that it begins are of low priority, too.
    at_low_priority([&] {
      DenoiseLayers found = find_denoise_layers(as_channels(task->image, task->layers), "the job's image");
      task->image = {}, task->layers = {};
      const DenoiseResult result = denoise_picture(
          std::move(found.input), {.threads = threads, .stop = stop, .interval = found.has_difference});
      task->point.denoised_relmse = result.relmse;
      task->point.denoised_relmse_low = result.relmse_low;
      task->point.denoised_relmse_high = result.relmse_high;
    });
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

}  // namespace

DenoisedErrors::~DenoisedErrors() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request_stop();
    wake_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

bool DenoisedErrors::has_room() const {
  const std::lock_guard lock(mutex_);
  return tasks_.size() < kMostTasks;
}

void DenoisedErrors::add(Task task) {
  const std::lock_guard lock(mutex_);
  tasks_.push_back(std::move(task));
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  wake_.notify_all();
}

void DenoisedErrors::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stop_.stop_requested() || !tasks_.empty(); });
    if (stop_.stop_requested()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    const std::string failure = estimate(&task, threads_, stop_.get_token());
    if (!stop_.stop_requested()) {
      try {
        done_(task.job, task.point, failure);
      } catch (const std::exception&) {
        // The store failed: StorageHealth knows, and the job is looked at again.
      }
    }
    lock.lock();
  }
}

}  // namespace lightmill
