#pragma once
// Which coordinator a farm has: the right to be it is leased by the database, whose own clock judges, so that
// clocks of machines play no part. Who holds it renews it; when it was not renewed for its length, another
// coordinator may take it, and the epoch grows. From then on the database refuses every write of the old one,
// however late it wakes up: each of its transactions names its epoch (fenced_connection.h).
//
// A database that starts gives the last leader the length of a lease to come back, before another takes over.
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "coordinator/store/postgres/postgres_db.h"

namespace lightmill {

class PostgresLease {
 public:
  /// Connects and makes the tables. Throws StoreError. `seconds`: its length.
  PostgresLease(const PostgresUrl& url, double seconds);
  /// Gives it back, so that the next one need not wait.
  ~PostgresLease();
  PostgresLease(const PostgresLease&) = delete;
  PostgresLease& operator=(const PostgresLease&) = delete;

  /// Takes it if nobody holds it, or its holder has not renewed it in time; it is then renewed in the
  /// background. False: another coordinator has it. Throws StoreError; connects again with the next call.
  bool try_take();
  /// Address of the coordinator that held it at the last try_take(); empty: not known yet.
  std::string holder() const;
  /// Where this one is reached, once it listens.
  void announce(const std::string& address);
  /// Names this leadership; 0 before.
  int64_t epoch() const { return epoch_; }
  const PostgresUrl& url() const { return url_; }
  double seconds() const { return seconds_; }

  /// Renews it, and makes durable what was written before, of which the database must have `writes`
  /// transactions of this epoch. Throws StoreError, and calls end() if it has not.
  void confirm(int64_t writes);

  /// Why this coordinator must not go on.
  struct End {
    bool taken_over = false;  // false: it is to load anew what the database has, which is not what it thinks
    std::string line;
  };
  /// The first call counts. Throws StoreError with the line.
  [[noreturn]] void end(bool taken_over, const std::string& line);
  /// What a database of another epoch means.
  [[noreturn]] void end_taken_over();
  std::optional<End> ended() const;

 private:
  PostgresConnection& connected();
  /// False if the database has another epoch or fewer writes.
  bool try_confirm(int64_t writes);
  void renew_until_stopped();

  const PostgresUrl url_;
  const double seconds_;
  mutable std::mutex mutex_;  // guards the connection, and what follows
  std::optional<PostgresConnection> db_;
  std::string holder_, address_;
  std::atomic<int64_t> epoch_ = 0;
  mutable std::mutex end_mutex_;
  std::optional<End> end_;
  std::mutex stop_mutex_;
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread renewer_;
};

}  // namespace lightmill
