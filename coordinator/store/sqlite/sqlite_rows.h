#pragma once
// Jobs, tiles and layers as rows of SQLite. Functions that write are called within a transaction.
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/farm/job_record.h"
#include "coordinator/store/sqlite/sqlite_db.h"

namespace lightmill::sqlite_rows {

/// Both, and all between. Throws StoreError, which names `path`, for a ledger that is damaged.
std::vector<TileRecord> tiles(Database& db, const std::string& path, const JobId& job, TileId first,
                              TileId last);
void insert_tiles(Database& db, const JobId& job, const std::vector<TileRecord>& tiles);
/// Updates all but cells and samples. Throws std::logic_error if there is no such tile.
void update_tile(Database& db, const JobId& job, const TileRecord& tile);
/// Throws std::logic_error if there is no such job.
void update_job(Database& db, const JobRecord& job);
/// Writes both rows if the tile is leased under the token that it was committed under; else returns false.
bool mark_committed(Database& db, const JobRecord& job, const TileRecord& tile);
/// Sets a layer in place of the one before, in pieces of at most `chunk_bytes`.
void set_layer(Database& db, const JobId& job, const std::string& kind, std::string_view bytes,
               size_t chunk_bytes);
/// Empty if there is none.
std::string layer(Database& db, const JobId& job, const std::string& kind);

}  // namespace lightmill::sqlite_rows
