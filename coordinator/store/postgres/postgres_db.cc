#include "coordinator/store/postgres/postgres_db.h"

#include <libpq-fe.h>

#include <charconv>

#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

/// libpq's messages have lines and tabs.
std::string in_one_line(const char* message) {
  std::string line;
  for (const char* c = message; c && *c; ++c) {
    const bool space = static_cast<unsigned char>(*c) <= ' ';
    if (!space) line += *c;
    if (space && !line.empty() && line.back() != ' ') line += ' ';
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

/// What holds unless the URL says something else: a server that is gone is noticed within about 10 s.
constexpr std::pair<const char*, const char*> kDefaults[] = {
    {"connect_timeout", "5"},  {"keepalives_idle", "5"},      {"keepalives_interval", "2"},
    {"keepalives_count", "3"}, {"tcp_user_timeout", "10000"}, {"application_name", "lightmill"},
};

}  // namespace

bool PostgresUrl::matches(const std::string& text) {
  return text.starts_with("postgresql://") || text.starts_with("postgres://");
}

PostgresUrl::PostgresUrl(const std::string& url) {
  char* problem = nullptr;
  PQconninfoOption* options = matches(url) ? PQconninfoParse(url.c_str(), &problem) : nullptr;
  if (!options) {
    PQfreemem(problem);  // it may quote the password
    throw Error(ErrorKind::kUsage,
                "--store: not an address of a database; write postgresql://USER@HOST:PORT/DATABASE, with "
                "%XX for special characters");
  }
  for (const PQconninfoOption* option = options; option->keyword; ++option) {
    if (option->val) keywords_[option->keyword] = option->val;
  }
  PQconninfoFree(options);
  const auto part = [this](const char* keyword, const char* before) {
    const auto found = keywords_.find(keyword);
    return found == keywords_.end() || found->second.empty() ? std::string() : before + found->second;
  };
  shown_ = "postgresql://";
  shown_ += part("user", "");
  if (keywords_.contains("user")) shown_ += '@';
  shown_ += part("host", "");
  shown_ += part("port", ":");
  shown_ += part("dbname", "/");
  for (const auto& [keyword, value] : kDefaults) keywords_.emplace(keyword, value);
  keywords_["client_encoding"] = "UTF8";
}

void PostgresResult::Clear::operator()(pg_result* result) const { PQclear(result); }
PostgresResult::PostgresResult(pg_result* result) : result_(result) {}
int PostgresResult::rows() const { return PQntuples(result_.get()); }
std::string PostgresResult::command() const { return PQcmdStatus(result_.get()); }

int64_t PostgresResult::changes() const {
  const std::string_view text = PQcmdTuples(result_.get());
  int64_t count = 0;
  std::from_chars(text.data(), text.data() + text.size(), count);
  return count;
}

std::string_view PostgresResult::bytes(int row, int column) const {
  return {PQgetvalue(result_.get(), row, column),
          static_cast<size_t>(PQgetlength(result_.get(), row, column))};
}
std::string PostgresResult::text(int row, int column) const { return std::string(bytes(row, column)); }

int64_t PostgresResult::integer(int row, int column) const {
  const std::string_view text = bytes(row, column);
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw StoreError("the database answered \"" + std::string(text) + "\" where a number belongs");
  }
  return value;
}

void PostgresConnection::Finish::operator()(pg_conn* connection) const { PQfinish(connection); }

PostgresConnection::PostgresConnection(const PostgresUrl& url, double transaction_seconds)
    : shown_(url.shown()) {
  std::vector<const char*> keywords, values;
  for (const auto& [keyword, value] : url.keywords()) {
    keywords.push_back(keyword.c_str());
    values.push_back(value.c_str());
  }
  keywords.push_back(nullptr);
  values.push_back(nullptr);
  connection_.reset(PQconnectdbParams(keywords.data(), values.data(), 0));
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    throw StoreError(shown_ +
                     ": can't connect to the job store: " + in_one_line(PQerrorMessage(connection_.get())));
  }
  // What the server says of tables that are there already, and the like, is of no use to anybody.
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  const auto milliseconds = static_cast<int64_t>(transaction_seconds * 1000);
  execute(
      "SET synchronous_commit TO on; SET lock_timeout TO '10s'; SET statement_timeout TO '60s'; "
      "SET idle_in_transaction_session_timeout TO " +
      std::to_string(milliseconds));
}

PostgresConnection::~PostgresConnection() = default;

bool PostgresConnection::alive() const { return PQstatus(connection_.get()) == CONNECTION_OK; }

void PostgresConnection::fail(const std::string& why) {
  throw StoreError(shown_ + ": the job store failed: " + (why.empty() ? "no answer" : why));
}

PostgresResult PostgresConnection::checked(pg_result* raw) {
  PostgresResult result(raw);
  const ExecStatusType status = PQresultStatus(raw);
  if (status != PGRES_COMMAND_OK && status != PGRES_TUPLES_OK) {
    fail(in_one_line(raw ? PQresultErrorMessage(raw) : PQerrorMessage(connection_.get())));
  }
  return result;
}

PostgresResult PostgresConnection::execute(const std::string& sql) {
  return checked(PQexec(connection_.get(), sql.c_str()));
}

PostgresResult PostgresConnection::run(const char* sql, std::initializer_list<PostgresValue> values,
                                       bool binary_result) {
  auto known = prepared_.find(sql);
  if (known == prepared_.end()) {
    std::string name = "s";
    name += std::to_string(prepared_.size());
    checked(PQprepare(connection_.get(), name.c_str(), sql, 0, nullptr));
    known = prepared_.emplace(sql, name).first;
  }
  std::vector<const char*> data;
  std::vector<int> lengths, formats;
  std::vector<std::string> texts;  // libpq wants texts to end with a zero
  texts.reserve(values.size());
  for (const PostgresValue& value : values) {
    if (!value.binary()) texts.emplace_back(value.view());
    // A null pointer would be NULL, not no bytes.
    const char* bytes = value.binary() ? value.view().data() : texts.back().c_str();
    data.push_back(bytes ? bytes : "");
    lengths.push_back(static_cast<int>(value.view().size()));
    formats.push_back(value.binary() ? 1 : 0);
  }
  return checked(PQexecPrepared(connection_.get(), known->second.c_str(), static_cast<int>(data.size()),
                                data.data(), lengths.data(), formats.data(), binary_result ? 1 : 0));
}

PostgresResult PostgresConnection::query(const char* sql, std::initializer_list<PostgresValue> values) {
  return run(sql, values, false);
}
PostgresResult PostgresConnection::query_bytes(const char* sql, std::initializer_list<PostgresValue> values) {
  return run(sql, values, true);
}

}  // namespace lightmill
