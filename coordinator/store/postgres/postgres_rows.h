#pragma once
// Jobs, tiles and layers as rows of PostgreSQL. Functions that write are called within a transaction.
#include <string>
#include <vector>

#include "coordinator/farm/job_record.h"
#include "coordinator/store/postgres/postgres_db.h"

namespace lightmill::postgres_rows {

/// Both, and all between. Throws StoreError for a ledger that is damaged.
std::vector<TileRecord> tiles(PostgresConnection& db, const JobId& job, TileId first, TileId last);
/// The first column.
std::vector<TileId> ids(const PostgresResult& rows);
void insert_tiles(PostgresConnection& db, const JobId& job, const std::vector<TileRecord>& tiles);
/// Updates all but cells and samples. Throws std::logic_error if there is no such tile.
void update_tile(PostgresConnection& db, const JobId& job, const TileRecord& tile);
/// Adds the job's row, and its bundle's unless it is there.
void insert_job(PostgresConnection& db, const JobRecord& job, const std::string& bundle_json);
/// Throws std::logic_error if there is no such job.
void update_job(PostgresConnection& db, const JobRecord& job);
/// Writes both rows if the tile is leased under the token that it was committed under; else returns false.
bool mark_committed(PostgresConnection& db, const JobRecord& job, const TileRecord& tile);
/// Sets the file of a layer, in place of the one before.
void set_layer(PostgresConnection& db, const JobId& job, const std::string& kind, const std::string& file,
               const std::string& digest);

}  // namespace lightmill::postgres_rows
