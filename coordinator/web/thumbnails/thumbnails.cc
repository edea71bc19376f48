#include "coordinator/web/thumbnails/thumbnails.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "coordinator/web/film_mark.h"

namespace lightmill {
namespace {

using Ticks = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr Seconds kLookSpacing(2);
constexpr Seconds kLeastSpacing(15);    // between two thumbnails of a job that is rendered
constexpr double kSpacingPerCost = 50;  // and so many times what the last one took
constexpr double kRestPerCost = 2;      // of the thread, after each one: commits of the job wait for it
constexpr size_t kPage = 64;            // jobs per lock of the farm

}  // namespace

Thumbnails::Thumbnails(const Farm& farm, const std::string& folder,
                       std::function<void(const std::string&)> log)
    : farm_(farm),
      store_(folder, std::move(log), {}),
      seen_(farm.page(0, 0, 0, false).version),
      thread_([this] { run(); }) {}

Thumbnails::~Thumbnails() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

std::optional<Thumbnails::Answer> Thumbnails::get(const JobId& job) {
  const JobStatus status = farm_.job(job);
  if (status.packets_done == 0) return std::nullopt;
  std::optional<ThumbnailStore::Thumbnail> found = store_.find(job);
  const bool current = found && found->mark == film_mark(status);
  if (!current) want(job);
  if (!found) return std::nullopt;
  return Answer{std::move(*found), current};
}

void Thumbnails::want(const JobId& job) {
  const std::lock_guard lock(mutex_);
  const auto not_before = not_before_.find(job);
  if (not_before != not_before_.end() && Ticks::now() < not_before->second) return;
  std::erase(wanted_, job);
  wanted_.push_back(job);
  if (wanted_.size() > kMostWanted) wanted_.pop_front();
  wake_.notify_all();
}

void Thumbnails::run() {
  std::unique_lock lock(mutex_);
  Time next_look = Ticks::now();
  while (!stopping_) {
    if (wanted_.empty()) {
      wake_.wait_until(lock, next_look, [&] { return stopping_ || !wanted_.empty(); });
    }
    if (stopping_) return;
    std::optional<JobId> job;
    if (!wanted_.empty()) {
      job = wanted_.back();
      wanted_.pop_back();
    }
    lock.unlock();
    const Time begin = Ticks::now();
    if (job) make(*job);
    const Seconds cost = Ticks::now() - begin;
    if (Ticks::now() >= next_look) {
      look_for_ended();
      next_look = Ticks::now() + std::chrono::duration_cast<Ticks::duration>(kLookSpacing);
    }
    lock.lock();
    if (job) {
      std::erase_if(not_before_, [&](const auto& item) { return item.second < begin; });
      const Seconds spacing = std::max(kLeastSpacing, kSpacingPerCost * cost);
      not_before_[*job] = begin + std::chrono::duration_cast<Ticks::duration>(spacing);
      wake_.wait_for(lock, kRestPerCost * cost, [&] { return stopping_; });
    }
  }
}

void Thumbnails::look_for_ended() {
  uint64_t version = seen_;
  for (size_t begin = 0, total = 1; begin < total; begin += kPage) {
    const JobPage page = farm_.page(begin, kPage, seen_, false);
    if (begin == 0) version = page.version;  // what changes meanwhile is found by the next look
    if (begin == 0 && version == seen_) return;
    total = page.total;
    for (const JobStatus& job : page.jobs) {
      if (!is_final(job.state) || job.packets_done == 0) continue;
      const std::lock_guard lock(mutex_);
      not_before_.erase(job.id);
      if (wanted_.size() < kMostWanted && std::find(wanted_.begin(), wanted_.end(), job.id) == wanted_.end())
        wanted_.push_front(job.id);
    }
  }
  seen_ = version;
}

void Thumbnails::make(const JobId& job) {
  try {
    const JobStatus status = farm_.job(job);
    const std::optional<ThumbnailStore::Thumbnail> known = store_.find(job);
    if (status.packets_done == 0 || (known && known->mark == film_mark(status))) return;
    store_.put(job, film_mark(status), encode_png(reduced(farm_.display_image(job), kSide)));
  } catch (const std::exception&) {
    // The job's own note says what is wrong with its film; it is tried again later.
  }
}

}  // namespace lightmill
