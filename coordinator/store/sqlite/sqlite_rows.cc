#include "coordinator/store/sqlite/sqlite_rows.h"

#include <stdexcept>

#include "coordinator/store/job_store.h"

namespace lightmill::sqlite_rows {

std::vector<TileRecord> tiles(Database& db, const std::string& path, const JobId& job, TileId first,
                              TileId last) {
  Statement select(
      db,
      "SELECT tile, x0, y0, x1, y1, sample_begin, sample_end, state, attempt, failures, worker, digest, "
      "rival_attempt, rival_worker, check_state FROM tiles WHERE job=? AND tile BETWEEN ? AND ? "
      "ORDER BY tile");
  select.bind(job.value).bind(first.value).bind(last.value);
  std::vector<TileRecord> records;
  while (select.step()) {
    TileRecord tile;
    tile.id = TileId{select.integer(0)};
    const auto cell = [&](int column) { return static_cast<int>(select.integer(column)); };
    tile.tile = {{cell(1), cell(2), cell(3), cell(4)}, select.integer(5), select.integer(6)};
    const int64_t state = select.integer(7);
    if (state < 0 || state > 2) throw StoreError(path + ": unknown tile state in the ledger");
    tile.state = static_cast<TileState>(state);
    tile.attempt = select.integer(8);
    tile.failures = static_cast<int>(select.integer(9));
    tile.worker = WorkerId{select.text(10)};
    tile.digest = select.text(11);
    tile.rival_attempt = select.integer(12);
    tile.rival_worker = WorkerId{select.text(13)};
    const int64_t check = select.integer(14);
    if (check < 0 || check > 2) throw StoreError(path + ": unknown state of a check in the ledger");
    tile.check = static_cast<TileCheck>(check);
    if (tile.id.value - first.value != static_cast<int64_t>(records.size())) {
      throw StoreError(path + ": the ledger of job " + job.value + " has gaps");
    }
    records.push_back(std::move(tile));
  }
  return records;
}

void insert_tiles(Database& db, const JobId& job, const std::vector<TileRecord>& tiles) {
  for (const TileRecord& tile : tiles) {
    const CellRect& c = tile.tile.cells;
    Statement(db,
              "INSERT INTO tiles(job, tile, x0, y0, x1, y1, sample_begin, sample_end, state, attempt, "
              "failures, worker, digest) VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?)")
        .bind(job.value)
        .bind(tile.id.value)
        .bind(c.x0)
        .bind(c.y0)
        .bind(c.x1)
        .bind(c.y1)
        .bind(tile.tile.sample_begin)
        .bind(tile.tile.sample_end)
        .bind(static_cast<int>(tile.state))
        .bind(tile.attempt)
        .bind(tile.failures)
        .bind(tile.worker.value)
        .bind(tile.digest)
        .run();
  }
}

void update_tile(Database& db, const JobId& job, const TileRecord& tile) {
  Statement(db,
            "UPDATE tiles SET state=?, attempt=?, failures=?, worker=?, digest=?, rival_attempt=?, "
            "rival_worker=?, check_state=? WHERE job=? AND tile=?")
      .bind(static_cast<int>(tile.state))
      .bind(tile.attempt)
      .bind(tile.failures)
      .bind(tile.worker.value)
      .bind(tile.digest)
      .bind(tile.rival_attempt)
      .bind(tile.rival_worker.value)
      .bind(static_cast<int>(tile.check))
      .bind(job.value)
      .bind(tile.id.value)
      .run();
  if (db.changes() != 1) throw std::logic_error("store: no tile " + std::to_string(tile.id.value));
}

void update_job(Database& db, const JobRecord& job) {
  const std::string record = job_record_to_json(job);
  Statement(db, "UPDATE jobs SET record=? WHERE id=?").bind(record).bind(job.id.value).run();
  if (db.changes() != 1) throw std::logic_error("store: no job " + job.id.value);
}

bool mark_committed(Database& db, const JobRecord& job, const TileRecord& tile) {
  const std::vector<LeaseToken> tokens = lease_tokens(tile);
  if (tokens.size() != 1) throw std::logic_error("store: a tile is committed under one lease");
  Statement(
      db,
      "UPDATE tiles SET state=2, digest=?1, worker=?2, rival_attempt=?3, rival_worker=?4, check_state=?5 "
      "WHERE job=?6 AND tile=?7 AND state=1 AND ((attempt=?8 AND worker=?9) OR "
      "(rival_attempt=?8 AND rival_worker=?9))")
      .bind(tile.digest)
      .bind(tile.worker.value)
      .bind(tile.rival_attempt)
      .bind(tile.rival_worker.value)
      .bind(static_cast<int>(tile.check))
      .bind(job.id.value)
      .bind(tile.id.value)
      .bind(tokens[0].attempt)
      .bind(tokens[0].worker.value)
      .run();
  if (db.changes() != 1) return false;
  update_job(db, job);
  return true;
}

void set_layer(Database& db, const JobId& job, const std::string& kind, std::string_view bytes,
               size_t chunk_bytes) {
  Statement(db, "DELETE FROM layers WHERE job=? AND kind=?").bind(job.value).bind(kind).run();
  int64_t part = 0;
  for (size_t at = 0; at < bytes.size(); at += chunk_bytes) {
    Statement(db, "INSERT INTO layers VALUES(?,?,?,?)")
        .bind(job.value)
        .bind(kind)
        .bind(part++)
        .bind_blob(bytes.substr(at, chunk_bytes))
        .run();
  }
}

std::string layer(Database& db, const JobId& job, const std::string& kind) {
  Statement select(db, "SELECT bytes FROM layers WHERE job=? AND kind=? ORDER BY part");
  select.bind(job.value).bind(kind);
  std::string bytes;
  while (select.step()) bytes += select.blob(0);
  return bytes;
}

}  // namespace lightmill::sqlite_rows
