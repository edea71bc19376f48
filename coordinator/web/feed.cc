#include "coordinator/web/feed.h"

#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/base/random_name.h"
#include "coordinator/web/json_views.h"

namespace lightmill {
namespace {

constexpr std::chrono::milliseconds kSpacing(500);
constexpr size_t kPage = 64;               // jobs per lock of the farm
constexpr bool kFrames = false;            // of sequences: their page asks for them (sequence_routes.h)
constexpr size_t kRowsPerEvent = 1000;     // so that a browser draws while it still reads
constexpr uint64_t kLooksPerWaiting = 10;  // jobs that wait change only by what is said of them
constexpr uint64_t kLooksPerWorkers = 2;

}  // namespace

Feed::Feed(const Farm& farm, const EventLog& log)
    : farm_(farm), log_(log), instance_(random_name()), thread_([this] { run(); }) {}

Feed::~Feed() {
  stop();
  thread_.join();
}

void Feed::stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  wake_.notify_all();
  changed_.notify_all();
}

std::string Feed::text(const Cursor& cursor) const {
  return instance_ + "-" + std::to_string(cursor.seen) + "-" + std::to_string(cursor.log);
}

Feed::Cursor Feed::cursor(const std::string& text) const {
  Cursor cursor;
  if (text.size() > 100 || !text.starts_with(instance_ + "-")) return {};
  if (std::sscanf(text.c_str() + instance_.size(), "-%" SCNu64 "-%" SCNu64, &cursor.seen, &cursor.log) != 2)
    return {};
  return cursor;
}

Feed::Listener::Listener(Feed& feed) : feed_(feed) {
  const std::lock_guard lock(feed_.mutex_);
  joined_ = feed_.looks_;
  ++feed_.listeners_;
  feed_.wake_.notify_all();
}

Feed::Listener::~Listener() {
  const std::lock_guard lock(feed_.mutex_);
  --feed_.listeners_;
}

void Feed::run() {
  std::unique_lock lock(mutex_);
  uint64_t since_idle = 0;
  while (!stopping_) {
    if (listeners_ == 0) {
      since_idle = 0;
      wake_.wait(lock, [&] { return stopping_ || listeners_ > 0; });
      continue;
    }
    const bool waiting = since_idle % kLooksPerWaiting == 0, workers = since_idle % kLooksPerWorkers == 0;
    ++since_idle;
    lock.unlock();
    News news = look(waiting, workers);
    lock.lock();
    take(std::move(news));
    ++looks_;
    changed_.notify_all();
    wake_.wait_for(lock, kSpacing, [&] { return stopping_; });
  }
}

Feed::News Feed::look(bool waiting, bool workers) {
  News news;
  news.with_workers = workers;
  uint64_t version = farm_version_;
  for (size_t begin = 0, total = 1; begin < total; begin += kPage) {
    const JobPage page = farm_.page(begin, kPage, farm_version_, waiting, kFrames);
    // What changes while the pages are read is found again by the next look.
    if (begin == 0) version = page.version;
    total = page.total;
    for (const JobStatus& job : page.jobs) news.jobs[job.id.value] = json_text(job_view(job));
  }
  farm_version_ = version;
  if (!workers) return news;
  std::map<WorkerId, std::vector<LeaseKey>> held;
  for (const auto& [worker, key] : farm_.holdings()) held[worker].push_back(key);
  for (const WorkerStatus& worker : farm_.workers())
    news.workers[worker.id.value] = json_text(worker_view(worker, held[worker.id]));
  return news;
}

void Feed::take(News news) {
  const uint64_t number = newest_ + 1;
  bool changed = false;
  const auto merge = [&](std::map<std::string, std::string>& from, Rows* rows) {
    for (auto& [id, text] : from) {
      Row& row = (*rows)[id];
      if (row.text == text) continue;
      row = {std::move(text), number};
      changed = true;
    }
  };
  merge(news.jobs, &jobs_);
  if (news.with_workers) {
    const size_t forgotten =
        std::erase_if(workers_, [&](const auto& row) { return !news.workers.contains(row.first); });
    merge(news.workers, &workers_);
    if (forgotten > 0) {
      workers_forgot_ = number;
      changed = true;
    }
  }
  if (changed) newest_ = number;
}

std::string Feed::rows(const char* event, const Rows& all, uint64_t after, bool full,
                       const Cursor& next) const {
  std::string events, list;
  size_t count = 0;
  const auto flush = [&](bool last) {
    events += std::string("event: ") + event + "\n";
    if (last) events += "id: " + text(next) + "\n";
    events += std::string("data: {\"full\":") + (full ? "true" : "false") + ",\"rows\":[" + list + "]}\n\n";
    full = false;
    list.clear();
    count = 0;
  };
  for (const auto& [id, row] : all) {
    if (row.changed <= after) continue;
    if (count == kRowsPerEvent) flush(false);
    if (count++ > 0) list += ',';
    list += row.text;
  }
  if (count > 0 || full) flush(true);
  return events;
}

std::string Feed::next(const Listener& listener, Cursor* cursor, double timeout_s) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    return stopping_ ||
           (looks_ > listener.joined_ && (newest_ > cursor->seen || log_.newest() > cursor->log));
  });
  if (stopping_ || looks_ == listener.joined_) return {};
  const bool first = cursor->seen == 0;
  Cursor moved = *cursor;
  moved.seen = newest_;
  std::string events = rows("jobs", jobs_, cursor->seen, first, moved);
  const bool all_workers = first || workers_forgot_ > cursor->seen;
  events += rows("workers", workers_, all_workers ? 0 : cursor->seen, all_workers, moved);
  lock.unlock();
  const std::vector<EventLog::Line> lines = log_.after(cursor->log);
  if (!lines.empty()) {
    moved.log = lines.back().number;
    events += "event: log\nid: " + text(moved) + "\ndata: " + json_text(log_view(lines)) + "\n\n";
  }
  *cursor = moved;
  return events;
}

}  // namespace lightmill
