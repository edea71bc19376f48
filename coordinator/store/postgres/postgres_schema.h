#pragma once
// The tables that a PostgreSQL database keeps a farm's jobs in; they lie in the first schema of the search
// path.
//
//   leader  one row: which coordinator the farm has, until when by the database's own clock, and its epoch,
//           which grows with every change of hands
//   fence   one row: the epoch again, and how many transactions the leader of this epoch has written. Every
//           one of them adds to it, and so waits for a takeover, or is waited for
//
// The rest is as in SQLite (sqlite_schema.cc), but for films, batches and references: these are files in
// the shared folder, of which `layers` has the names and digests.
#include "coordinator/store/postgres/postgres_db.h"

namespace lightmill {

/// Makes the tables, or brings them up to date. Any number of coordinators may do so at the same time. Throws
/// StoreError if a newer version wrote them, or the database is not fit for it.
void prepare_postgres_schema(PostgresConnection& db, const std::string& shown);

}  // namespace lightmill
