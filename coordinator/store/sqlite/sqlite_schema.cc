#include "coordinator/store/sqlite/sqlite_schema.h"

#include <iterator>

#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

constexpr int64_t kSchemaVersion = 7;
constexpr int64_t kOldestSchema = 2;

constexpr const char* kTables = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE counters(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE bundles(digest TEXT PRIMARY KEY, manifest TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE jobs(
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
  bundle TEXT NOT NULL REFERENCES bundles(digest),
  record TEXT NOT NULL);
-- Their frames are jobs.
CREATE TABLE sequences(
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  id TEXT NOT NULL UNIQUE,
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
    // Jobs may be frames of a sequence.
    "CREATE TABLE sequences(number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, "
    "record TEXT NOT NULL)",
};
static_assert(std::size(kMigrations) == kSchemaVersion - kOldestSchema);

}  // namespace

void prepare_sqlite_schema(Database& db, const std::string& path) {
  Transaction transaction(db);
  const bool fresh = !Statement(db, "SELECT 1 FROM sqlite_master WHERE name='meta'").step();
  if (fresh) {
    db.execute(kTables);
    Statement(db, "INSERT INTO meta VALUES('schema', ?)").bind(kSchemaVersion).run();
  } else {
    int64_t version = 0;
    {
      Statement select(db, "SELECT value FROM meta WHERE key='schema'");
      if (select.step()) version = select.integer(0);
    }
    if (version > kSchemaVersion) {
      throw StoreError(path + ": a newer version of Lightmill wrote this job store (schema " +
                       std::to_string(version) + ", this one knows up to " + std::to_string(kSchemaVersion) +
                       "); use that version or a new --data folder");
    }
    if (version < kOldestSchema) {
      throw StoreError(path + ": the job store has schema " + std::to_string(version) +
                       ", which is too old or damaged; use the version that wrote it or a new --data folder");
    }
    for (; version < kSchemaVersion; ++version) db.execute(kMigrations[version - kOldestSchema]);
    Statement(db, "UPDATE meta SET value=? WHERE key='schema'").bind(kSchemaVersion).run();
  }
  transaction.commit();
}

}  // namespace lightmill
