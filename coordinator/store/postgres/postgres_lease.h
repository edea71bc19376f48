#pragma once
// The lease of leadership: which coordinator leads a farm. The database leases it and judges by its own
// clock, so the clocks of machines play no part. The leader renews the lease. If it was not renewed for its
// length, another coordinator may take it, and the epoch grows. From then on the database refuses every write
// of the old leader, however late it wakes up: each of its transactions names its epoch
// (fenced_connection.h).
//
// A database that starts gives the last leader the length of a lease to come back before another takes over.
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
  /// Connects and makes the tables. Throws StoreError. `seconds`: the lease's length.
  PostgresLease(const PostgresUrl& url, double seconds);
  /// Gives the lease back, so that the next leader need not wait.
  ~PostgresLease();
  PostgresLease(const PostgresLease&) = delete;
  PostgresLease& operator=(const PostgresLease&) = delete;

  /// Takes the lease if nobody holds it, or if its holder has not renewed it in time. It is then renewed in
  /// the background. Returns false if another coordinator has it. Throws StoreError; the next call connects
  /// again.
  bool try_take();
  /// Address of the coordinator that held the lease at the last try_take(); empty: not known yet.
  std::string holder() const;
  /// Sets this coordinator's address, once it listens.
  void announce(const std::string& address);
  /// The number of this leadership; 0 before.
  int64_t epoch() const { return epoch_; }
  const PostgresUrl& url() const { return url_; }
  double seconds() const { return seconds_; }

  /// Renews the lease and makes durable what was written before. The database must have `writes` transactions
  /// of this epoch: if not, calls end(). Throws StoreError.
  void confirm(int64_t writes);

  /// Why this coordinator must not go on.
  struct End {
    bool taken_over = false;  // false: the database has other data than this memory; load them anew
    std::string line;
  };
  /// The first call counts. Throws StoreError with the line.
  [[noreturn]] void end(bool taken_over, const std::string& line);
  /// Ends because the database has another epoch.
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
