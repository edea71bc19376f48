#pragma once
// A thin RAII layer over libpq: a connection string that hides its password, a connection, results. Errors
// become StoreError that names the database. A lost connection stays lost: what was in progress may or may
// not have happened, and only the owner can tell what to do (libpqxx 6 would silently connect anew). Not
// thread-safe; the owner serialises.
//
//   PostgresConnection db(url);
//   db.query("UPDATE jobs SET record=$1 WHERE id=$2", {text, id});
//   const PostgresResult rows = db.query("SELECT tile FROM spool WHERE job=$1", {id});
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct pg_conn;
struct pg_result;

namespace lightmill {

/// "postgresql://USER@HOST:PORT/DATABASE?...", parsed by libpq.
class PostgresUrl {
 public:
  /// Throws Error(kUsage) for what libpq does not understand. The message does not repeat the URL, as it may
  /// have a password.
  explicit PostgresUrl(const std::string& url);
  /// Whether the text is meant to be such a URL.
  static bool matches(const std::string& text);
  /// For people and logs: without password and parameters.
  const std::string& shown() const { return shown_; }
  /// Keywords of libpq and their values.
  const std::map<std::string, std::string>& keywords() const { return keywords_; }

 private:
  std::map<std::string, std::string> keywords_;
  std::string shown_;
};

/// A parameter of a statement. Texts and bytes are not copied: they must live until the statement has run.
class PostgresValue {
 public:
  PostgresValue(int64_t value) : text_(std::to_string(value)), view_(text_) {}
  PostgresValue(int value) : PostgresValue(int64_t{value}) {}
  PostgresValue(const std::string& text) : view_(text) {}
  static PostgresValue bytes(std::string_view bytes) { return PostgresValue(bytes, true); }
  PostgresValue(const PostgresValue& other)
      : text_(other.text_),
        view_(other.text_.empty() ? other.view_ : std::string_view(text_)),
        binary_(other.binary_) {}
  PostgresValue& operator=(const PostgresValue&) = delete;
  std::string_view view() const { return view_; }
  bool binary() const { return binary_; }

 private:
  PostgresValue(std::string_view bytes, bool binary) : view_(bytes), binary_(binary) {}
  std::string text_;
  std::string_view view_;
  bool binary_ = false;
};

/// Rows that a statement returned; empty for one that returns none.
class PostgresResult {
 public:
  explicit PostgresResult(pg_result* result);
  int rows() const;
  bool empty() const { return rows() == 0; }
  /// Rows that an INSERT, UPDATE or DELETE changed.
  int64_t changes() const;
  int64_t integer(int row, int column) const;
  std::string text(int row, int column) const;
  /// The bytes as they came; in a query_bytes, those of a bytea. Valid as long as the result.
  std::string_view bytes(int row, int column) const;
  /// The command tag: "COMMIT", "UPDATE 1".
  std::string command() const;

 private:
  struct Clear {
    void operator()(pg_result* result) const;
  };
  std::unique_ptr<pg_result, Clear> result_;
};

class PostgresConnection {
 public:
  /// Connects within a few seconds. The server ends the session after `transaction_seconds` in the middle of
  /// a transaction without a statement, so that a program that hangs holds no locks.
  PostgresConnection(const PostgresUrl& url, double transaction_seconds);
  ~PostgresConnection();
  PostgresConnection(const PostgresConnection&) = delete;
  PostgresConnection& operator=(const PostgresConnection&) = delete;
  /// Statements without parameters, in one round trip; the result is the last one's.
  PostgresResult execute(const std::string& sql);
  /// A statement with parameters $1, $2, ...; prepared once: `sql` must be a literal.
  PostgresResult query(const char* sql, std::initializer_list<PostgresValue> values);
  /// The same for one that returns nothing but bytea.
  PostgresResult query_bytes(const char* sql, std::initializer_list<PostgresValue> values);
  /// False once the connection was lost.
  bool alive() const;

 private:
  PostgresResult run(const char* sql, std::initializer_list<PostgresValue> values, bool binary_result);
  PostgresResult checked(pg_result* result);
  [[noreturn]] void fail(const std::string& why);

  std::string shown_;
  struct Finish {
    void operator()(pg_conn* connection) const;
  };
  std::unique_ptr<pg_conn, Finish> connection_;
  std::map<const char*, std::string> prepared_;  // names by the address of their text
};

}  // namespace lightmill
