#include "coordinator/store/postgres/postgres_lease.h"

#include <chrono>

#include "coordinator/store/job_store.h"
#include "coordinator/store/postgres/postgres_schema.h"

namespace lightmill {
namespace {

constexpr double kRenewalsPerLease = 3;

/// $1: the lease's length in milliseconds. True if it may be taken; and the address of who has it.
#define LIGHTMILL_LOOK                                                                                \
  "SELECT NOT held OR greatest(expires, pg_postmaster_start_time() + $1 * interval '1 millisecond') " \
  "< clock_timestamp(), address FROM leader"
constexpr const char* kLook = LIGHTMILL_LOOK;
constexpr const char* kLookAndLock = LIGHTMILL_LOOK " FOR UPDATE";
#undef LIGHTMILL_LOOK
constexpr const char* kTake =
    "UPDATE leader SET epoch=epoch+1, address='', held=true, "
    "expires=clock_timestamp() + $1 * interval '1 millisecond' RETURNING epoch";
constexpr const char* kTakeFence = "UPDATE fence SET epoch=$1, writes=0";
constexpr const char* kConfirm =
    "UPDATE leader SET address=$2, expires=clock_timestamp() + $3 * interval '1 millisecond' "
    "WHERE epoch=$1 AND (SELECT writes FROM fence) >= $4";
constexpr const char* kGiveBack = "UPDATE leader SET held=false, address='' WHERE epoch=$1";

int64_t milliseconds(double seconds) { return static_cast<int64_t>(seconds * 1000); }

}  // namespace

PostgresLease::PostgresLease(const PostgresUrl& url, double seconds) : url_(url), seconds_(seconds) {
  prepare_postgres_schema(connected(), url_.shown());
}

PostgresLease::~PostgresLease() {
  {
    const std::lock_guard lock(stop_mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  if (renewer_.joinable()) renewer_.join();
  if (epoch_ == 0) return;
  try {
    const std::lock_guard lock(mutex_);
    connected().query(kGiveBack, {epoch_.load()});
  } catch (const Error&) {
    // It runs out by itself.
  }
}

PostgresConnection& PostgresLease::connected() {
  if (db_ && !db_->alive()) db_.reset();
  if (!db_) db_.emplace(url_, seconds_);
  return *db_;
}

bool PostgresLease::try_take() {
  const std::lock_guard lock(mutex_);
  PostgresConnection& db = connected();
  try {
    // Whoever only looks must not hold up the one who renews.
    const PostgresResult found = db.query(kLook, {milliseconds(seconds_)});
    if (found.empty()) throw StoreError(url_.shown() + ": the table \"leader\" is empty");
    holder_ = found.text(0, 1);
    if (found.text(0, 0) != "t") return false;
    db.execute("BEGIN");
    if (db.query(kLookAndLock, {milliseconds(seconds_)}).text(0, 0) != "t") {  // another one was faster
      db.execute("ROLLBACK");
      return false;
    }
    const int64_t epoch = db.query(kTake, {milliseconds(seconds_)}).integer(0, 0);
    db.query(kTakeFence, {epoch});  // waits for what the old leader has under way
    db.execute("COMMIT");
    epoch_ = epoch;
  } catch (...) {
    db_.reset();
    throw;
  }
  renewer_ = std::thread([this] { renew_until_stopped(); });
  return true;
}

std::string PostgresLease::holder() const {
  const std::lock_guard lock(mutex_);
  return holder_;
}

void PostgresLease::announce(const std::string& address) {
  {
    const std::lock_guard lock(mutex_);
    address_ = address;
  }
  confirm(0);
}

bool PostgresLease::try_confirm(int64_t writes) {
  const PostgresResult done =
      connected().query(kConfirm, {epoch_.load(), address_, milliseconds(seconds_), writes});
  return done.changes() == 1;
}

void PostgresLease::confirm(int64_t writes) {
  if (const std::optional<End> end = ended()) throw StoreError(end->line);
  bool current = false;
  {
    const std::lock_guard lock(mutex_);
    bool confirmed = false;
    try {
      confirmed = try_confirm(writes);
    } catch (const StoreError&) {
      if (!db_ || db_->alive()) throw;
      confirmed = try_confirm(writes);  // the connection was lost; once more does no harm
    }
    if (confirmed) return;
    const PostgresResult found = connected().execute("SELECT epoch FROM leader");
    current = !found.empty() && found.integer(0, 0) == epoch_;
  }
  if (!current) end_taken_over();
  end(false, url_.shown() +
                 ": the database has lost what it had not yet written to its disk; "
                 "loading what it has");
}

void PostgresLease::end(bool taken_over, const std::string& line) {
  const std::lock_guard lock(end_mutex_);
  if (!end_) end_ = End{taken_over, line};
  throw StoreError(end_->line);
}

void PostgresLease::end_taken_over() {
  end(true,
      url_.shown() + ": another coordinator has taken over, as this one did not renew its lease in time");
}

std::optional<PostgresLease::End> PostgresLease::ended() const {
  const std::lock_guard lock(end_mutex_);
  return end_;
}

void PostgresLease::renew_until_stopped() {
  const std::chrono::duration<double> pause(seconds_ / kRenewalsPerLease);
  std::unique_lock lock(stop_mutex_);
  while (!stop_.wait_for(lock, pause, [this] { return stopping_; })) {
    lock.unlock();
    try {
      confirm(0);
    } catch (const StoreError&) {
      // Who writes will hear of it; the lease may be ours for all that, or ended() says that it isn't.
    }
    lock.lock();
  }
}

}  // namespace lightmill
