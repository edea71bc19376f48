#pragma once
// What changes on the farm, for any number of browsers at their own pace.
//
// One thread looks at the farm twice a second while somebody listens, and keeps the newest text of every row
// with the number of its last change. A listener asks for what is newer than its cursor: who is slow gets
// fewer, larger steps and never a backlog, and who was cut off goes on where it stopped. Nobody waits for a
// listener.
//
//   Feed::Listener here(feed);
//   for (Feed::Cursor at; send(feed.next(here, &at, 2.0));) {}
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

#include "coordinator/core/farm.h"
#include "coordinator/service/event_log.h"

namespace lightmill {

class Feed {
 public:
  /// `farm` and `log` must outlive the feed.
  Feed(const Farm& farm, const EventLog& log);
  ~Feed();

  struct Cursor {
    uint64_t seen = 0;  // number of the newest change that was sent; 0: nothing yet
    uint64_t log = 0;   // number of the newest log line
  };
  /// For a browser to come back with; another coordinator process does not take it.
  std::string text(const Cursor& cursor) const;
  /// Inverse; {} for what is none, or of another process: everything will be sent.
  Cursor cursor(const std::string& text) const;
  /// Names this process.
  const std::string& instance() const { return instance_; }

  class Listener {
   public:
    explicit Listener(Feed& feed);
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

   private:
    friend class Feed;
    Feed& feed_;
    uint64_t joined_ = 0;  // looks of the feed before
  };
  /// Server-Sent Events with what is newer than `cursor`, which moves on: "jobs" and "workers" with rows
  /// ({"full": true} where the list begins anew), "log" with lines. Waits up to `timeout_s` for news; empty
  /// if there are none.
  std::string next(const Listener& listener, Cursor* cursor, double timeout_s);
  /// Makes every waiting and later next() return at once.
  void stop();

 private:
  struct Row {
    std::string text;
    uint64_t changed = 0;
  };
  using Rows = std::unordered_map<std::string, Row>;
  struct News {
    std::map<std::string, std::string> jobs, workers;  // text by id
    bool with_workers = false;
  };
  void run();
  News look(bool waiting, bool workers);
  void take(News news);
  std::string rows(const char* event, const Rows& rows, uint64_t after, bool full, const Cursor& next) const;

  const Farm& farm_;
  const EventLog& log_;
  const std::string instance_;
  uint64_t farm_version_ = 0;  // of the thread alone
  std::mutex mutex_;
  std::condition_variable wake_, changed_;
  bool stopping_ = false;
  int listeners_ = 0;
  uint64_t looks_ = 0;           // so far
  uint64_t newest_ = 0;          // number of the newest change
  uint64_t workers_forgot_ = 0;  // change by which a worker was last forgotten
  Rows jobs_, workers_;
  std::thread thread_;
};

}  // namespace lightmill
