#include "tests/coordinator/store/any_store.h"

#include "coordinator/store/memory_job_store.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"

namespace lightmill::testing {
namespace {

constexpr size_t kShortChunks = 1000;

}  // namespace

std::string store_name(const ::testing::TestParamInfo<StoreKind>& info) {
  switch (info.param) {
    case StoreKind::kMemory:
      return "Memory";
    case StoreKind::kSqlite:
      return "Sqlite";
    case StoreKind::kPostgres:
      return "Postgres";
  }
  return "";
}

AnyStore::AnyStore(StoreKind kind)
    : kind_(kind), url_(kind == StoreKind::kPostgres ? fresh_postgres() : std::string()) {}
AnyStore::~AnyStore() = default;

JobStore& AnyStore::reopen() {
  switch (kind_) {
    case StoreKind::kMemory:
      if (!store_) store_ = std::make_unique<MemoryJobStore>();
      return *store_;
    case StoreKind::kSqlite:
      store_.reset();
      store_ = std::make_unique<SqliteJobStore>(folder_.file("jobs.sqlite"), kShortChunks);
      return *store_;
    case StoreKind::kPostgres:
      postgres_.reset();
      postgres_ = std::make_unique<PostgresFarm>(url_, folder_.path(), kShortChunks);
      return *postgres_->store;
  }
  throw std::logic_error("unknown kind of store");
}

}  // namespace lightmill::testing
