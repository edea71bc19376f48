#pragma once
// The leader's connection to the database. It lets no transaction through of a coordinator that does not lead
// any more, and notices every transaction that is lost.
//
// Every transaction names the epoch of this coordinator's lease and counts itself, in the row `fence`. One of
// an older epoch finds no row and changes nothing. The count settles what a lost connection has left open:
// whether the last COMMIT arrived, and whether a database that crashed still has what was not flushed. If it
// is not this coordinator's count, memory and database differ. Then the lease ends, and the farm must be
// loaded anew.
//
// After any failure nothing is read or written before reconnect() has compared the counts. Thread-safe.
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "coordinator/store/group_flush.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/postgres/postgres_lease.h"

namespace lightmill {

class FencedConnection {
 public:
  using Action = std::function<bool(PostgresConnection&)>;
  /// When a transaction's changes survive a crash of the database: once it has committed, or after flush().
  enum class Durability { kNow, kFlush };

  /// `lease` must be held, and outlive the connection. Throws StoreError.
  explicit FencedConnection(PostgresLease& lease);

  /// Runs `action(connection)` while no other thread has it. Counts the connection as lost if that throws
  /// StoreError. Throws it also before a reconnect(), and after the lease has ended.
  template <class Read>
  auto read(Read&& action) -> decltype(action(std::declval<PostgresConnection&>())) {
    const std::lock_guard lock(mutex_);
    require_lease();
    if (!db_) throw StoreError(fault_);
    try {
      return action(*db_);
    } catch (const StoreError& error) {
      lose(error);
      throw;
    }
  }
  /// The same in a transaction of this epoch, which is committed if `action` returns true.
  bool write(Durability durability, const Action& action);
  /// Makes durable what was written before. Throws StoreError.
  void flush();
  /// Makes a new connection and tries it with a transaction. Throws StoreError.
  void reconnect(const Action& action);

 private:
  void require_lease() const;
  void lose(const StoreError& error);
  bool transact(Durability durability, const Action& action);

  PostgresLease& lease_;
  std::mutex mutex_;
  std::optional<PostgresConnection> db_;  // none after a failure
  std::string fault_;                     // what it was
  std::atomic<int64_t> written_ = 0;      // transactions of this epoch
  GroupFlush group_;
};

}  // namespace lightmill
