#pragma once
// A thin RAII layer over SQLite: a connection, statements, transactions. Errors become StoreError that names
// the file. Not thread-safe, except for sync(); the owner serialises.
//
//   Transaction transaction(db);
//   Statement(db, "UPDATE jobs SET record=? WHERE id=?").bind(text).bind(id).run();
//   transaction.commit();
#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace lightmill {

/// When a transaction is on disk.
enum class Durability {
  kNow,    // when it returns
  kFlush,  // after the next sync(), or the next transaction with kNow
};

class Database {
 public:
  /// Opens or creates the file, in WAL mode.
  explicit Database(const std::string& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  /// Runs statements without parameters or results.
  void execute(const char* sql);
  /// Makes everything durable that was committed before the call. From any thread, also while another one
  /// writes.
  void sync();
  /// False after an error of the disk. Then nothing is written, as the system may have dropped what it could
  /// not write, until restore_trust() has copied the log into the database and synced both.
  bool trusted() const { return trusted_; }
  void restore_trust();
  /// Rows that the last statement changed.
  int64_t changes() const;
  [[noreturn]] void fail();

 private:
  friend class Statement;
  friend class Transaction;
  void set_durability(Durability durability);

  std::string path_;
  sqlite3* handle_ = nullptr;
  std::map<const char*, sqlite3_stmt*> idle_;  // prepared before, by the address of their text
  std::atomic<bool> trusted_ = true;
  Durability durability_ = Durability::kNow;
};

/// A statement is prepared once and kept by the database: `sql` must be a literal.
class Statement {
 public:
  Statement(Database& db, const char* sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  /// Binds parameters, in order. Texts and blobs are not copied: they must live until the statement has run.
  Statement& bind(int64_t value);
  Statement& bind(int value) { return bind(int64_t{value}); }
  Statement& bind(const std::string& text);
  Statement& bind_blob(std::string_view bytes);
  /// Next row; false at the end.
  bool step();
  /// For statements without rows.
  void run() { step(); }
  int64_t integer(int column) const;
  std::string text(int column) const;
  /// Valid until the next step.
  std::string_view blob(int column) const;

 private:
  Database& db_;
  const char* sql_;
  sqlite3_stmt* statement_ = nullptr;
  int next_parameter_ = 1;
};

/// Rolls back unless committed.
class Transaction {
 public:
  explicit Transaction(Database& db, Durability durability = Durability::kNow);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& db_;
  bool open_ = true;
};

}  // namespace lightmill
