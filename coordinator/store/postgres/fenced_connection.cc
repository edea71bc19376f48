#include "coordinator/store/postgres/fenced_connection.h"

namespace lightmill {

FencedConnection::FencedConnection(PostgresLease& lease) : lease_(lease) {
  db_.emplace(lease_.url(), lease_.seconds());
  written_ = db_->execute("SELECT writes FROM fence").integer(0, 0);
}

void FencedConnection::require_lease() const {
  if (const auto end = lease_.ended()) throw StoreError(end->line);
}

void FencedConnection::lose(const StoreError& error) {
  fault_ = error.what();
  db_.reset();
}

bool FencedConnection::write(Durability durability, const Action& action) {
  return read([&](PostgresConnection&) { return transact(durability, action); });
}

bool FencedConnection::transact(Durability durability, const Action& action) {
  PostgresConnection& db = *db_;
  const PostgresResult counted =
      db.execute(std::string("BEGIN; SET LOCAL synchronous_commit TO ") +
                 (durability == Durability::kNow ? "on" : "off") +
                 "; UPDATE fence SET writes=writes+1 WHERE epoch=" + std::to_string(lease_.epoch()) +
                 " RETURNING writes");
  if (counted.empty()) lease_.end_taken_over();
  const int64_t number = counted.integer(0, 0);
  if (number != written_ + 1) {
    lease_.end(false,
               lease_.url().shown() +
                   ": the connection was lost so that this coordinator and the database differ; loading "
                   "what the database has");
  }
  bool wanted = false;
  try {
    wanted = action(db);
  } catch (const StoreError&) {
    throw;  // the connection goes, and the transaction with it
  } catch (...) {
    db.execute("ROLLBACK");
    throw;
  }
  if (!wanted) {
    db.execute("ROLLBACK");
    return false;
  }
  if (const std::string done = db.execute("COMMIT").command(); done != "COMMIT") {
    throw StoreError(lease_.url().shown() + ": the job store failed: a transaction ended with " + done);
  }
  written_ = number;
  return true;
}

void FencedConnection::flush() {
  group_.flush(written_, [this](int64_t transactions) { lease_.confirm(transactions); });
}

void FencedConnection::reconnect(const Action& action) {
  const std::lock_guard lock(mutex_);
  require_lease();
  try {
    db_.emplace(lease_.url(), lease_.seconds());
    transact(Durability::kNow, action);
  } catch (const StoreError& error) {
    lose(error);
    throw;
  }
}

}  // namespace lightmill
