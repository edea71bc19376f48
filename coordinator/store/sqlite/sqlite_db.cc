#include "coordinator/store/sqlite/sqlite_db.h"

#include <sqlite3.h>

#include "coordinator/store/job_store.h"

namespace lightmill {

Database::Database(const std::string& path) : path_(path) {
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX;
  if (sqlite3_open_v2(path.c_str(), &handle_, flags, nullptr) != SQLITE_OK) {
    const std::string why = handle_ ? sqlite3_errmsg(handle_) : "out of memory";
    sqlite3_close(handle_);
    throw StoreError(path + ": can't open the job store: " + why);
  }
  try {
    sqlite3_busy_timeout(handle_, 10000);
    execute("PRAGMA journal_mode=WAL");
    execute("PRAGMA synchronous=FULL");
    execute("PRAGMA journal_size_limit=67108864");
    execute("PRAGMA foreign_keys=ON");
  } catch (...) {
    sqlite3_close(handle_);
    throw;
  }
}

Database::~Database() {
  for (const auto& [sql, statement] : idle_) sqlite3_finalize(statement);
  sqlite3_close(handle_);
}

void Database::execute(const char* sql) {
  if (sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

void Database::sync() {
  // SQLite syncs the log itself before it moves anything from there into the database, so this is all that is
  // left to do for transactions that did not.
  sqlite3_file* log = nullptr;
  const int found = sqlite3_file_control(handle_, nullptr, SQLITE_FCNTL_JOURNAL_POINTER, &log);
  if (found != SQLITE_OK || !log || !log->pMethods) throw StoreError(path_ + ": the job store has no log");
  if (!trusted_ || log->pMethods->xSync(log, SQLITE_SYNC_NORMAL) != SQLITE_OK) {
    trusted_ = false;
    throw StoreError(path_ + ": the job store failed: can't sync its log; is the disk full or damaged?");
  }
}

void Database::restore_trust() {
  Statement checkpoint(*this, "PRAGMA wal_checkpoint(TRUNCATE)");
  if (!checkpoint.step() || checkpoint.integer(0) != 0) {
    throw StoreError(path_ + ": the job store failed: can't empty its log; does another program read it?");
  }
  trusted_ = true;
}

void Database::set_durability(Durability durability) {
  if (durability_ == durability) return;
  execute(durability == Durability::kNow ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=NORMAL");
  durability_ = durability;
}

int64_t Database::changes() const { return sqlite3_changes64(handle_); }

void Database::fail() {
  if ((sqlite3_errcode(handle_) & 0xff) == SQLITE_IOERR) trusted_ = false;
  throw StoreError(path_ + ": the job store failed: " + sqlite3_errmsg(handle_) +
                   "; is the disk full or damaged?");
}

Statement::Statement(Database& db, const char* sql) : db_(db), sql_(sql) {
  if (const auto idle = db.idle_.find(sql); idle != db.idle_.end()) {
    statement_ = idle->second;
    db.idle_.erase(idle);
  } else if (sqlite3_prepare_v3(db.handle_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement_, nullptr) !=
             SQLITE_OK) {
    db.fail();
  }
}
Statement::~Statement() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  if (!db_.idle_.emplace(sql_, statement_).second) sqlite3_finalize(statement_);
}

Statement& Statement::bind(int64_t value) {
  if (sqlite3_bind_int64(statement_, next_parameter_++, value) != SQLITE_OK) db_.fail();
  return *this;
}
Statement& Statement::bind(const std::string& text) {
  if (sqlite3_bind_text64(statement_, next_parameter_++, text.data(), text.size(), SQLITE_STATIC,
                          SQLITE_UTF8) != SQLITE_OK) {
    db_.fail();
  }
  return *this;
}
Statement& Statement::bind_blob(std::string_view bytes) {
  if (sqlite3_bind_blob64(statement_, next_parameter_++, bytes.data(), bytes.size(), SQLITE_STATIC) !=
      SQLITE_OK) {
    db_.fail();
  }
  return *this;
}

bool Statement::step() {
  switch (sqlite3_step(statement_)) {
    case SQLITE_ROW:
      return true;
    case SQLITE_DONE:
      return false;
    default:
      db_.fail();
  }
}

int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }
std::string Statement::text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return text ? std::string(text, static_cast<size_t>(sqlite3_column_bytes(statement_, column)))
              : std::string();
}
std::string_view Statement::blob(int column) const {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  return bytes ? std::string_view(bytes, static_cast<size_t>(sqlite3_column_bytes(statement_, column)))
               : std::string_view();
}

Transaction::Transaction(Database& db, Durability durability) : db_(db) {
  if (!db_.trusted()) throw StoreError(db_.path_ + ": the job store failed before and is not mended yet");
  db_.set_durability(durability);
  Statement(db_, "BEGIN IMMEDIATE").run();
}
Transaction::~Transaction() {
  if (!open_) return;
  try {
    db_.execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has rolled back by itself already.
  }
}
void Transaction::commit() {
  Statement(db_, "COMMIT").run();
  open_ = false;
}

}  // namespace lightmill
