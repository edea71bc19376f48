#pragma once
// The tables of a job store in SQLite, and how those of older versions become today's.
#include <string>

#include "coordinator/store/sqlite/sqlite_db.h"

namespace lightmill {

/// Makes the tables, or brings them up to date, in one transaction. Throws StoreError, which names `path`, if
/// a newer version wrote them or one that is too old.
void prepare_sqlite_schema(Database& db, const std::string& path);

}  // namespace lightmill
