#include "coordinator/web/denoised/denoised_pictures.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "coordinator/core/low_priority.h"
#include "coordinator/web/film_mark.h"

namespace lightmill {
namespace {

constexpr double kTimePerCpu = 4;  // from one picture to the next, so many times what it took of a processor
constexpr double kTimePerRead = 20;  // likewise of the film's time, for which commits of the job wait

}  // namespace

DenoisedPictures::DenoisedPictures(const Farm& farm, Pictures& pictures, int64_t most_pixels)
    : farm_(farm), pictures_(pictures), most_pixels_(most_pixels), thread_([this] { run(); }) {}

DenoisedPictures::~DenoisedPictures() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request_stop();
    wake_.notify_all();
  }
  thread_.join();
}

std::optional<DenoisedPictures::Answer> DenoisedPictures::get(const JobId& job) {
  const JobStatus status = farm_.job(job);
  if (status.packets_done == 0) return std::nullopt;
  const std::lock_guard lock(mutex_);
  std::shared_ptr<const Image> image = pictures_.kept(job);
  const auto made = made_.find(job);
  const bool there = image && made != made_.end();
  const bool current = there && made->second.mark == film_mark(status);
  if (!current) {
    wishes_.add(job);
    wake_.notify_all();
  }
  if (!there) return std::nullopt;
  Answer answer{made->second.figures, made->second.mark, current};
  answer.picture.image = std::move(image);
  return answer;
}

void DenoisedPictures::run() {
  std::unique_lock lock(mutex_);
  const auto stopped = [&] { return stop_.stop_requested(); };
  while (!stopped()) {
    wake_.wait(lock, [&] { return stopped() || !wishes_.empty(); });
    const std::optional<JobId> job = wishes_.take();
    if (stopped() || !job) continue;
    lock.unlock();
    const Clock::time_point next = make(*job);
    lock.lock();
    wake_.wait_until(lock, next, stopped);
  }
}

DenoisedPictures::Clock::time_point DenoisedPictures::make(const JobId& job) {
  const Clock::time_point begin = Clock::now();
  double cost = 0;
  try {
    const std::string mark = film_mark(farm_.job(job));
    {
      const std::lock_guard lock(mutex_);
      const auto made = made_.find(job);
      if (made != made_.end() && made->second.mark == mark && pictures_.kept(job)) return begin;
    }
    // At this thread's own priority: commits of the job wait for it.
    Image image;
    ChannelImage layers = farm_.aovs(job, &image, true);
    const double read = std::chrono::duration<double>(Clock::now() - begin).count();
    cost = kTimePerRead * read;
    DenoisedPicture picture;
    const double cpu = at_low_priority([&] {
      picture = denoised_picture(std::move(image), std::move(layers), most_pixels_, stop_.get_token());
    });
    cost = std::max(cost, kTimePerCpu * (read + cpu));
    keep(job, mark, std::move(picture));
  } catch (const std::exception&) {
    // The job's own note says what is wrong with its film; it is tried again when it is asked for again.
    cost = std::max(cost, kTimePerCpu * std::chrono::duration<double>(Clock::now() - begin).count());
  }
  return begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(cost));
}

void DenoisedPictures::keep(const JobId& job, const std::string& mark, DenoisedPicture picture) {
  const std::lock_guard lock(mutex_);
  const std::shared_ptr<const Image> image = std::exchange(picture.image, nullptr);
  pictures_.keep(job, image);
  wishes_.remove(job);  // whoever finds it out of date asks again
  made_[job] = {std::move(picture), mark, image};
  std::erase_if(made_, [](const auto& item) { return item.second.image.expired(); });
}

}  // namespace lightmill
