#pragma once
// The tables of a job store in SQLite, and the migrations from older versions.
#include <string>

#include "coordinator/store/sqlite/sqlite_db.h"

namespace lightmill {

/// Makes the tables, or brings them up to date, in one transaction. Throws StoreError, which names `path`, if
/// they are of a newer version or of one that is too old.
void prepare_sqlite_schema(Database& db, const std::string& path);

}  // namespace lightmill
