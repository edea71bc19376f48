#include "coordinator/store/postgres/postgres_rows.h"

#include <stdexcept>

#include "coordinator/store/job_store.h"

namespace lightmill::postgres_rows {
namespace {

/// "{1,2,3}", as PostgreSQL writes arrays, of what `value` says of each tile.
template <class Value>
std::string array(const std::vector<TileRecord>& tiles, Value&& value) {
  std::string text = "{";
  for (const TileRecord& tile : tiles) {
    if (text.size() > 1) text += ',';
    text += value(tile);
  }
  text += '}';
  return text;
}

std::string quoted(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  text += '"';
  return text;
}

}  // namespace

std::vector<TileRecord> tiles(PostgresConnection& db, const JobId& job, TileId first, TileId last) {
  const PostgresResult rows = db.query(
      "SELECT tile, x0, y0, x1, y1, sample_begin, sample_end, state, attempt, failures, worker, digest, "
      "rival_attempt, rival_worker, check_state FROM tiles WHERE job=$1 AND tile BETWEEN $2 AND $3 "
      "ORDER BY tile",
      {job.value, first.value, last.value});
  std::vector<TileRecord> records;
  for (int row = 0; row < rows.rows(); ++row) {
    TileRecord tile;
    tile.id = TileId{rows.integer(row, 0)};
    const auto small = [&](int column) { return static_cast<int>(rows.integer(row, column)); };
    tile.tile = {{small(1), small(2), small(3), small(4)}, rows.integer(row, 5), rows.integer(row, 6)};
    const int state = small(7), check = small(14);
    if (state < 0 || state > 2) throw StoreError("job " + job.value + ": unknown tile state in the ledger");
    if (check < 0 || check > 2) throw StoreError("job " + job.value + ": unknown state of a check");
    tile.state = static_cast<TileState>(state);
    tile.attempt = rows.integer(row, 8);
    tile.failures = small(9);
    tile.worker = WorkerId{rows.text(row, 10)};
    tile.digest = rows.text(row, 11);
    tile.rival_attempt = rows.integer(row, 12);
    tile.rival_worker = WorkerId{rows.text(row, 13)};
    tile.check = static_cast<TileCheck>(check);
    if (tile.id.value - first.value != row) throw StoreError("the ledger of job " + job.value + " has gaps");
    records.push_back(std::move(tile));
  }
  return records;
}

std::vector<TileId> ids(const PostgresResult& rows) {
  std::vector<TileId> list;
  list.reserve(static_cast<size_t>(rows.rows()));
  for (int row = 0; row < rows.rows(); ++row) list.push_back(TileId{rows.integer(row, 0)});
  return list;
}

void insert_tiles(PostgresConnection& db, const JobId& job, const std::vector<TileRecord>& tiles) {
  const auto numbers = [&](auto&& value) {
    return array(tiles, [&](const TileRecord& tile) { return std::to_string(value(tile)); });
  };
  using Tile = const TileRecord&;
  db.query(
      "INSERT INTO tiles(job, tile, x0, y0, x1, y1, sample_begin, sample_end, state, attempt, failures, "
      "worker, digest) SELECT $1, * FROM unnest($2::bigint[], $3::int[], $4::int[], $5::int[], $6::int[], "
      "$7::bigint[], $8::bigint[], $9::int[], $10::bigint[], $11::int[], $12::text[], $13::text[])",
      {job.value, numbers([](Tile t) { return t.id.value; }), numbers([](Tile t) { return t.tile.cells.x0; }),
       numbers([](Tile t) { return t.tile.cells.y0; }), numbers([](Tile t) { return t.tile.cells.x1; }),
       numbers([](Tile t) { return t.tile.cells.y1; }), numbers([](Tile t) { return t.tile.sample_begin; }),
       numbers([](Tile t) { return t.tile.sample_end; }),
       numbers([](Tile t) { return static_cast<int>(t.state); }), numbers([](Tile t) { return t.attempt; }),
       numbers([](Tile t) { return t.failures; }),
       array(tiles, [](Tile t) { return quoted(t.worker.value); }),
       array(tiles, [](Tile t) { return quoted(t.digest); })});
}

void update_tile(PostgresConnection& db, const JobId& job, const TileRecord& tile) {
  const PostgresResult done = db.query(
      "UPDATE tiles SET state=$1, attempt=$2, failures=$3, worker=$4, digest=$5, rival_attempt=$6, "
      "rival_worker=$7, check_state=$8 WHERE job=$9 AND tile=$10",
      {static_cast<int>(tile.state), tile.attempt, tile.failures, tile.worker.value, tile.digest,
       tile.rival_attempt, tile.rival_worker.value, static_cast<int>(tile.check), job.value, tile.id.value});
  if (done.changes() != 1) throw std::logic_error("store: no tile " + std::to_string(tile.id.value));
}

void insert_job(PostgresConnection& db, const JobRecord& job, const std::string& bundle_json) {
  const std::string record = job_record_to_json(job);
  db.query("INSERT INTO bundles VALUES($1, $2) ON CONFLICT DO NOTHING", {job.bundle_digest, bundle_json});
  db.query("INSERT INTO jobs(id, bundle, record) VALUES($1, $2, $3)",
           {job.id.value, job.bundle_digest, record});
}

void update_job(PostgresConnection& db, const JobRecord& job) {
  const std::string record = job_record_to_json(job);
  const PostgresResult done = db.query("UPDATE jobs SET record=$1 WHERE id=$2", {record, job.id.value});
  if (done.changes() != 1) throw std::logic_error("store: no job " + job.id.value);
}

bool mark_committed(PostgresConnection& db, const JobRecord& job, const TileRecord& tile) {
  const std::vector<LeaseToken> tokens = lease_tokens(tile);
  if (tokens.size() != 1) throw std::logic_error("store: a tile is committed under one lease");
  const PostgresResult done = db.query(
      "UPDATE tiles SET state=2, digest=$1, worker=$2, rival_attempt=$3, rival_worker=$4, check_state=$5 "
      "WHERE job=$6 AND tile=$7 AND state=1 AND ((attempt=$8 AND worker=$9) OR "
      "(rival_attempt=$8 AND rival_worker=$9))",
      {tile.digest, tile.worker.value, tile.rival_attempt, tile.rival_worker.value,
       static_cast<int>(tile.check), job.id.value, tile.id.value, tokens[0].attempt, tokens[0].worker.value});
  if (done.changes() != 1) return false;
  update_job(db, job);
  return true;
}

void set_layer(PostgresConnection& db, const JobId& job, const std::string& kind, const std::string& file,
               const std::string& digest) {
  db.query(
      "INSERT INTO layers VALUES($1, $2, $3, $4) ON CONFLICT(job, kind) DO UPDATE SET "
      "file = excluded.file, digest = excluded.digest",
      {job.value, kind, file, digest});
}

}  // namespace lightmill::postgres_rows
