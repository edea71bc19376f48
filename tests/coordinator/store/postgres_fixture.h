#pragma once
// A PostgreSQL for the tests of a process: started with the first database that is asked for, ended with the
// process, however that ends.
#include <memory>
#include <optional>
#include <string>

#include "coordinator/store/postgres/postgres_job_store.h"

namespace lightmill::testing {

/// URL of a database of its own (a schema of the one server), without tables; empty if there is no PostgreSQL
/// on this machine.
std::string fresh_postgres();

/// Where none is: why a test is skipped.
inline constexpr const char* kNoPostgres = "no PostgreSQL server here; install postgresql";

/// So long that nothing is renewed, and no lease runs out, in a test.
inline constexpr double kLongLease = 3600;

/// A lease that is held, and its store.
struct PostgresFarm {
  /// Throws what they throw; std::logic_error if somebody else holds the lease.
  PostgresFarm(const std::string& url, const std::string& folder, size_t chunk_bytes = 1000);
  PostgresLease lease;
  std::unique_ptr<PostgresJobStore> store;
};

}  // namespace lightmill::testing
