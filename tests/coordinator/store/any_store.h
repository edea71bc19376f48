#pragma once
// A store of any kind, for tests that hold for all of them; where there is no PostgreSQL that one is left
// out.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "coordinator/store/job_store.h"
#include "tests/coordinator/core/fake_worker.h"
#include "tests/coordinator/store/postgres_fixture.h"

namespace lightmill::testing {

enum class StoreKind { kMemory, kSqlite, kPostgres };
inline const auto kAllStores =
    ::testing::Values(StoreKind::kMemory, StoreKind::kSqlite, StoreKind::kPostgres);
/// For INSTANTIATE_TEST_SUITE_P.
std::string store_name(const ::testing::TestParamInfo<StoreKind>& info);

class AnyStore {
 public:
  explicit AnyStore(StoreKind kind);
  ~AnyStore();
  AnyStore(const AnyStore&) = delete;
  AnyStore& operator=(const AnyStore&) = delete;
  bool usable() const { return kind_ != StoreKind::kPostgres || !url_.empty(); }
  /// The store, opened anew, as after a restart; one in memory is still the same.
  JobStore& reopen();

 private:
  const StoreKind kind_;
  const std::string url_;
  const TemporaryFolder folder_;
  std::unique_ptr<JobStore> store_;
  std::unique_ptr<PostgresFarm> postgres_;
};

}  // namespace lightmill::testing
