#include "coordinator/sqlite_job_store.h"

#include <algorithm>
#include <iterator>

#include "coordinator/image_bytes.h"

namespace lightmill {
namespace {

constexpr int64_t kSchemaVersion = 6;
constexpr int64_t kOldestSchema = 2;
constexpr size_t kMaxProbeBytes = size_t{64} << 20;

constexpr const char* kTables = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE counters(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE bundles(digest TEXT PRIMARY KEY, manifest TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE jobs(
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  bundle TEXT NOT NULL REFERENCES bundles(digest),
  record TEXT NOT NULL);
-- The ledger. state: 0 pending, 1 leased, 2 committed.
CREATE TABLE tiles(
  job TEXT NOT NULL REFERENCES jobs(id),
  tile INTEGER NOT NULL,
  x0 INTEGER NOT NULL, y0 INTEGER NOT NULL, x1 INTEGER NOT NULL, y1 INTEGER NOT NULL,
  sample_begin INTEGER NOT NULL, sample_end INTEGER NOT NULL,
  state INTEGER NOT NULL, attempt INTEGER NOT NULL, failures INTEGER NOT NULL,
  worker TEXT NOT NULL, digest TEXT NOT NULL,
  rival_attempt INTEGER NOT NULL DEFAULT 0, rival_worker TEXT NOT NULL DEFAULT '',
  check_state INTEGER NOT NULL DEFAULT 0,
  PRIMARY KEY(job, tile)) WITHOUT ROWID;
-- Committed partials, as they came, in chunks. The snapshot contains those up to the row in `folded`.
CREATE TABLE spool(
  job TEXT NOT NULL, tile INTEGER NOT NULL, part INTEGER NOT NULL, bytes BLOB NOT NULL,
  UNIQUE(job, tile, part));
CREATE TABLE folded(job TEXT PRIMARY KEY, row INTEGER NOT NULL) WITHOUT ROWID;
-- kind: film, batches, reference, pilot.
CREATE TABLE layers(
  job TEXT NOT NULL, kind TEXT NOT NULL, part INTEGER NOT NULL, bytes BLOB NOT NULL,
  UNIQUE(job, kind, part));
CREATE TABLE points(job TEXT NOT NULL, number INTEGER NOT NULL, point TEXT NOT NULL,
  PRIMARY KEY(job, number)) WITHOUT ROWID;
)sql";

/// What turns the tables of version kOldestSchema + i into those of the next.
constexpr const char* kMigrations[] = {
    "DROP TABLE quarantine",  // refused partials are files now
    "",                       // records may have a submitter, a limit of workers and dependencies
    // Two workers may race for a tile.
    "ALTER TABLE tiles ADD COLUMN rival_attempt INTEGER NOT NULL DEFAULT 0;"
    "ALTER TABLE tiles ADD COLUMN rival_worker TEXT NOT NULL DEFAULT ''",
    // A tile may be rendered again for comparison; partials may stay when a snapshot contains them.
    "ALTER TABLE tiles ADD COLUMN check_state INTEGER NOT NULL DEFAULT 0;"
    "CREATE TABLE folded(job TEXT PRIMARY KEY, row INTEGER NOT NULL) WITHOUT ROWID",
};
static_assert(std::size(kMigrations) == kSchemaVersion - kOldestSchema);

}  // namespace

SqliteJobStore::SqliteJobStore(const std::string& path, size_t chunk_bytes)
    : db_(path), path_(path), chunk_bytes_(chunk_bytes) {
  create_tables();
  // The log is there, with its name in the folder, before anybody flushes it; and a disk that can't be
  // written is noticed now.
  Transaction transaction(db_);
  db_.execute("INSERT INTO meta VALUES('opened', 1) ON CONFLICT(key) DO UPDATE SET value = value + 1");
  transaction.commit();
}

void SqliteJobStore::create_tables() {
  Transaction transaction(db_);
  const bool fresh = !Statement(db_, "SELECT 1 FROM sqlite_master WHERE name='meta'").step();
  if (fresh) {
    db_.execute(kTables);
    Statement(db_, "INSERT INTO meta VALUES('schema', ?)").bind(kSchemaVersion).run();
  } else {
    int64_t version = 0;
    {
      Statement select(db_, "SELECT value FROM meta WHERE key='schema'");
      if (select.step()) version = select.integer(0);
    }
    if (version > kSchemaVersion) {
      throw StoreError(path_ + ": a newer version of Lightmill wrote this job store (schema " +
                       std::to_string(version) + ", this one knows up to " + std::to_string(kSchemaVersion) +
                       "); use that version or a new --data folder");
    }
    if (version < kOldestSchema) {
      throw StoreError(path_ + ": the job store has schema " + std::to_string(version) +
                       ", which is too old or damaged; use the version that wrote it or a new --data folder");
    }
    for (; version < kSchemaVersion; ++version) db_.execute(kMigrations[version - kOldestSchema]);
    Statement(db_, "UPDATE meta SET value=? WHERE key='schema'").bind(kSchemaVersion).run();
  }
  transaction.commit();
}

std::vector<JobRecord> SqliteJobStore::jobs() {
  const std::lock_guard lock(mutex_);
  std::vector<JobRecord> records;
  Statement select(db_, "SELECT id, record FROM jobs ORDER BY number");
  while (select.step()) records.push_back(job_record_from_json(JobId{select.text(0)}, select.text(1)));
  return records;
}

std::vector<TileRecord> SqliteJobStore::tiles(const JobId& job) {
  const std::lock_guard lock(mutex_);
  Statement select(
      db_,
      "SELECT tile, x0, y0, x1, y1, sample_begin, sample_end, state, attempt, failures, worker, digest, "
      "rival_attempt, rival_worker, check_state FROM tiles WHERE job=? ORDER BY tile");
  select.bind(job.value);
  std::vector<TileRecord> records;
  while (select.step()) {
    TileRecord tile;
    tile.id = TileId{select.integer(0)};
    const auto cell = [&](int column) { return static_cast<int>(select.integer(column)); };
    tile.tile = {{cell(1), cell(2), cell(3), cell(4)}, select.integer(5), select.integer(6)};
    const int64_t state = select.integer(7);
    if (state < 0 || state > 2) throw StoreError(path_ + ": unknown tile state in the ledger");
    tile.state = static_cast<TileState>(state);
    tile.attempt = select.integer(8);
    tile.failures = static_cast<int>(select.integer(9));
    tile.worker = WorkerId{select.text(10)};
    tile.digest = select.text(11);
    tile.rival_attempt = select.integer(12);
    tile.rival_worker = WorkerId{select.text(13)};
    const int64_t check = select.integer(14);
    if (check < 0 || check > 2) throw StoreError(path_ + ": unknown state of a check in the ledger");
    tile.check = static_cast<TileCheck>(check);
    if (tile.id.value != static_cast<int64_t>(records.size())) {
      throw StoreError(path_ + ": the ledger of job " + job.value + " has gaps");
    }
    records.push_back(std::move(tile));
  }
  return records;
}

std::vector<ErrorPoint> SqliteJobStore::curve(const JobId& job) {
  const std::lock_guard lock(mutex_);
  std::vector<ErrorPoint> points;
  Statement select(db_, "SELECT point FROM points WHERE job=? ORDER BY number");
  select.bind(job.value);
  while (select.step()) {
    for (const ErrorPoint& point : curve_from_json(select.text(0)).points) points.push_back(point);
  }
  return points;
}

std::optional<std::string> SqliteJobStore::bundle_json(const std::string& digest) {
  const std::lock_guard lock(mutex_);
  Statement select(db_, "SELECT manifest FROM bundles WHERE digest=?");
  select.bind(digest);
  if (!select.step()) return std::nullopt;
  return select.text(0);
}

void SqliteJobStore::put_layer(const JobId& job, const std::string& kind, std::string_view bytes) {
  Statement(db_, "DELETE FROM layers WHERE job=? AND kind=?").bind(job.value).bind(kind).run();
  int64_t part = 0;
  for (size_t at = 0; at < bytes.size(); at += chunk_bytes_) {
    Statement(db_, "INSERT INTO layers VALUES(?,?,?,?)")
        .bind(job.value)
        .bind(kind)
        .bind(part++)
        .bind_blob(bytes.substr(at, chunk_bytes_))
        .run();
  }
}

std::string SqliteJobStore::get_layer(const JobId& job, const std::string& kind) {
  Statement select(db_, "SELECT bytes FROM layers WHERE job=? AND kind=? ORDER BY part");
  select.bind(job.value).bind(kind);
  std::string bytes;
  while (select.step()) bytes += select.blob(0);
  return bytes;
}

Image SqliteJobStore::reference(const JobId& job) {
  const std::lock_guard lock(mutex_);
  const std::string bytes = get_layer(job, "reference");
  if (bytes.empty()) return {};
  Image image = image_from_bytes(bytes);
  if (image.data.empty())
    throw StoreError(path_ + ": the reference image of job " + job.value + " is damaged");
  return image;
}

std::string SqliteJobStore::pilot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return get_layer(job, "pilot");
}

LayerSnapshot SqliteJobStore::snapshot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return {get_layer(job, "film"), get_layer(job, "batches")};
}

void SqliteJobStore::for_each_spooled(const JobId& job,
                                      const std::function<void(const std::string&)>& visit) {
  std::vector<int64_t> tiles;
  {
    const std::lock_guard lock(mutex_);
    Statement select(db_,
                     "SELECT tile FROM spool WHERE job=?1 AND part=0 AND rowid > "
                     "COALESCE((SELECT row FROM folded WHERE job=?1), 0) ORDER BY tile");
    select.bind(job.value);
    while (select.step()) tiles.push_back(select.integer(0));
  }
  // One at a time: folding takes long, and others need the store meanwhile.
  for (const int64_t tile : tiles) visit(partial(job, TileId{tile}));
}

std::string SqliteJobStore::partial(const JobId& job, TileId tile) {
  const std::lock_guard lock(mutex_);
  Statement select(db_, "SELECT bytes FROM spool WHERE job=? AND tile=? ORDER BY part");
  select.bind(job.value).bind(tile.value);
  std::string bytes;
  while (select.step()) bytes += select.blob(0);
  return bytes;
}

std::vector<TileId> SqliteJobStore::kept_partials(const JobId& job) {
  const std::lock_guard lock(mutex_);
  std::vector<TileId> tiles;
  Statement select(db_, "SELECT tile FROM spool WHERE job=? AND part=0 ORDER BY tile");
  select.bind(job.value);
  while (select.step()) tiles.push_back(TileId{select.integer(0)});
  return tiles;
}

int64_t SqliteJobStore::next_number(const std::string& counter) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  int64_t value = 0;
  {
    Statement upsert(db_,
                     "INSERT INTO counters VALUES(?, 1) ON CONFLICT(name) DO UPDATE SET value = value + 1 "
                     "RETURNING value");
    upsert.bind(counter);
    if (!upsert.step()) db_.fail();
    value = upsert.integer(0);
    upsert.step();
  }
  transaction.commit();
  return value;
}

void SqliteJobStore::add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) {
  const std::lock_guard lock(mutex_);
  const std::string record = job_record_to_json(job);
  Transaction transaction(db_);
  Statement(db_, "INSERT OR IGNORE INTO bundles VALUES(?,?)").bind(job.bundle_digest).bind(bundle_json).run();
  Statement(db_, "INSERT INTO jobs(id, bundle, record) VALUES(?,?,?)")
      .bind(job.id.value)
      .bind(job.bundle_digest)
      .bind(record)
      .run();
  if (!reference.data.empty()) put_layer(job.id, "reference", image_to_bytes(reference));
  transaction.commit();
}

SqliteJobStore::LeasedState SqliteJobStore::leased_state(const JobRecord& job) {
  return {job.state, job.arithmetic_class, job.leases_reassigned};
}

void SqliteJobStore::write_job(const JobRecord& job) {
  rows_.erase(job.id);  // whether it gets there is not known yet
  const std::string record = job_record_to_json(job);
  Statement(db_, "UPDATE jobs SET record=? WHERE id=?").bind(record).bind(job.id.value).run();
  if (db_.changes() != 1) throw std::logic_error("store: no job " + job.id.value);
}

void SqliteJobStore::save_job(const JobRecord& job) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  write_job(job);
  transaction.commit();
}

void SqliteJobStore::insert_tiles(const JobId& job, const std::vector<TileRecord>& tiles) {
  for (const TileRecord& tile : tiles) {
    const CellRect& c = tile.tile.cells;
    Statement(db_,
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

void SqliteJobStore::add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_, Durability::kFlush);
  insert_tiles(job, tiles);
  transaction.commit();
  ++written_;
}

void SqliteJobStore::split_tile(const JobId& job, const TileRecord& smaller,
                                const std::vector<TileRecord>& others) {
  const std::lock_guard lock(mutex_);
  const CellRect& c = smaller.tile.cells;
  Transaction transaction(db_, Durability::kFlush);
  Statement(db_, "UPDATE tiles SET x0=?, y0=?, x1=?, y1=? WHERE job=? AND tile=? AND state=0")
      .bind(c.x0)
      .bind(c.y0)
      .bind(c.x1)
      .bind(c.y1)
      .bind(job.value)
      .bind(smaller.id.value)
      .run();
  if (db_.changes() != 1) throw std::logic_error("store: only a pending tile can be split");
  insert_tiles(job, others);
  transaction.commit();
  ++written_;
}

void SqliteJobStore::write_tile(const JobId& job, const TileRecord& tile) {
  Statement(db_,
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
  if (db_.changes() != 1) throw std::logic_error("store: no tile " + std::to_string(tile.id.value));
}

void SqliteJobStore::save_tile(const JobRecord& job, const TileRecord& tile) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_, Durability::kFlush);
  write_tile(job.id, tile);
  // Most leases change nothing of the job but its wall time, which the next commit writes.
  const auto row = rows_.find(job.id);
  if (row == rows_.end() || !(row->second == leased_state(job))) write_job(job);
  transaction.commit();
  rows_.insert_or_assign(job.id, leased_state(job));
  ++written_;
}

bool SqliteJobStore::mark_committed(const JobRecord& job, const TileRecord& tile) {
  const std::vector<LeaseToken> tokens = lease_tokens(tile);
  if (tokens.size() != 1) throw std::logic_error("store: a tile is committed under one lease");
  Statement(
      db_,
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
  if (db_.changes() != 1) return false;
  write_job(job);
  return true;
}

bool SqliteJobStore::commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  if (!mark_committed(job, pilot)) return false;
  put_layer(job.id, "pilot", report);
  transaction.commit();
  return true;
}

bool SqliteJobStore::commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) {
  const std::lock_guard lock(mutex_);
  attempted_bytes_ = partial.size();
  Transaction transaction(db_, Durability::kFlush);
  if (!mark_committed(job, tile)) return false;
  int64_t part = 0;
  for (size_t at = 0; at < partial.size(); at += chunk_bytes_) {
    Statement(db_, "INSERT INTO spool VALUES(?,?,?,?)")
        .bind(job.id.value)
        .bind(tile.id.value)
        .bind(part++)
        .bind_blob(partial.substr(at, chunk_bytes_))
        .run();
  }
  transaction.commit();
  rows_.insert_or_assign(job.id, leased_state(job));
  ++written_;
  return true;
}

void SqliteJobStore::flush() {
  group_.flush(written_, [this](int64_t) { db_.sync(); });
}

void SqliteJobStore::probe() {
  const std::lock_guard lock(mutex_);
  db_.restore_trust();
  {
    Transaction transaction(db_);
    Statement(db_, "INSERT OR REPLACE INTO layers VALUES('', 'probe', 0, zeroblob(?))")
        .bind(static_cast<int64_t>(std::min(attempted_bytes_, kMaxProbeBytes)))
        .run();
    transaction.commit();
  }
  Transaction transaction(db_);
  db_.execute("DELETE FROM layers WHERE job=''");
  transaction.commit();
}

void SqliteJobStore::add_point(const JobId& job, const ErrorPoint& point) {
  const std::lock_guard lock(mutex_);
  const std::string text = curve_to_json({"", {point}});
  Transaction transaction(db_);
  Statement(db_, "INSERT INTO points SELECT ?1, COALESCE(MAX(number), 0) + 1, ?2 FROM points WHERE job=?1")
      .bind(job.value)
      .bind(text)
      .run();
  transaction.commit();
}

void SqliteJobStore::checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) {
  const std::lock_guard lock(mutex_);
  attempted_bytes_ = snapshot.film.size() + snapshot.batches.size();
  Transaction transaction(db_);
  put_layer(job, "film", snapshot.film);
  put_layer(job, "batches", snapshot.batches);
  if (keep_partials) {
    Statement(db_,
              "INSERT OR REPLACE INTO folded SELECT ?1, MAX(rowid) FROM spool WHERE job=?1 HAVING MAX(rowid)")
        .bind(job.value)
        .run();
  } else {
    Statement(db_, "DELETE FROM spool WHERE job=?").bind(job.value).run();
    Statement(db_, "DELETE FROM folded WHERE job=?").bind(job.value).run();
  }
  transaction.commit();
}

void SqliteJobStore::take_back(const JobRecord& job, const std::vector<TileRecord>& tiles) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  for (const TileRecord& tile : tiles) {
    write_tile(job.id, tile);
    Statement(db_, "DELETE FROM spool WHERE job=? AND tile=?").bind(job.id.value).bind(tile.id.value).run();
  }
  put_layer(job.id, "film", "");
  put_layer(job.id, "batches", "");
  Statement(db_, "DELETE FROM folded WHERE job=?").bind(job.id.value).run();
  Statement(db_, "DELETE FROM points WHERE job=?").bind(job.id.value).run();
  write_job(job);
  transaction.commit();
}

}  // namespace lightmill
