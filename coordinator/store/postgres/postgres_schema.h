#pragma once
// The tables of a farm's jobs in PostgreSQL, in the first schema of the search path.
//
//   leader  one row: which coordinator leads the farm, until when by the database's own clock, and its epoch,
//           which grows with every change of leader
//   fence   one row: the epoch again, and how many transactions the leader of this epoch has written. Every
//           transaction adds to it. So it waits for a takeover, or a takeover waits for it
//
// The rest is as in SQLite (sqlite_schema.cc), except for films, batches and references. These are files in
// the shared folder, and `layers` has their names and digests.
#include "coordinator/store/postgres/postgres_db.h"

namespace lightmill {

/// Makes the tables, or brings them up to date. Any number of coordinators may do so at the same time. Throws
/// StoreError if a newer version wrote them, or the database does not fit.
void prepare_postgres_schema(PostgresConnection& db, const std::string& shown);

}  // namespace lightmill
