#include "coordinator/store/postgres/postgres_schema.h"

#include <iterator>

#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

constexpr int64_t kSchemaVersion = 2;

constexpr const char* kTables = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE leader(
  one BOOLEAN PRIMARY KEY DEFAULT true CHECK(one),
  epoch BIGINT NOT NULL, address TEXT NOT NULL, held BOOLEAN NOT NULL, expires TIMESTAMPTZ NOT NULL);
INSERT INTO leader VALUES(true, 0, '', false, '-infinity');
-- Every transaction changes this row: room on its page lets it be changed in place.
CREATE TABLE fence(
  one BOOLEAN PRIMARY KEY DEFAULT true CHECK(one),
  epoch BIGINT NOT NULL, writes BIGINT NOT NULL) WITH (fillfactor=50);
INSERT INTO fence VALUES(true, 0, 0);
CREATE TABLE counters(name TEXT PRIMARY KEY, value BIGINT NOT NULL);
CREATE TABLE bundles(digest TEXT PRIMARY KEY, manifest TEXT NOT NULL);
CREATE TABLE jobs(
  number BIGSERIAL PRIMARY KEY,
  id TEXT NOT NULL UNIQUE,
  bundle TEXT NOT NULL REFERENCES bundles(digest),
  record TEXT NOT NULL);
-- Their frames are jobs.
CREATE TABLE sequences(number BIGSERIAL PRIMARY KEY, id TEXT NOT NULL UNIQUE, record TEXT NOT NULL);
-- The ledger. state: 0 pending, 1 leased, 2 committed.
CREATE TABLE tiles(
  job TEXT NOT NULL REFERENCES jobs(id),
  tile BIGINT NOT NULL,
  x0 INTEGER NOT NULL, y0 INTEGER NOT NULL, x1 INTEGER NOT NULL, y1 INTEGER NOT NULL,
  sample_begin BIGINT NOT NULL, sample_end BIGINT NOT NULL,
  state INTEGER NOT NULL, attempt BIGINT NOT NULL, failures INTEGER NOT NULL,
  worker TEXT NOT NULL, digest TEXT NOT NULL,
  rival_attempt BIGINT NOT NULL DEFAULT 0, rival_worker TEXT NOT NULL DEFAULT '',
  check_state INTEGER NOT NULL DEFAULT 0,
  PRIMARY KEY(job, tile)) WITH (fillfactor=80);
-- Committed partials, as they came, in chunks. The snapshot contains those up to the row in `folded`.
CREATE TABLE spool(
  number BIGSERIAL PRIMARY KEY,
  job TEXT NOT NULL, tile BIGINT NOT NULL, part INTEGER NOT NULL, bytes BYTEA NOT NULL,
  UNIQUE(job, tile, part));
ALTER TABLE spool ALTER COLUMN bytes SET STORAGE EXTERNAL;  -- they are compressed already
CREATE TABLE folded(job TEXT PRIMARY KEY, number BIGINT NOT NULL);
-- kind: film, batches, reference. `file` lies in the shared folder.
CREATE TABLE layers(
  job TEXT NOT NULL, kind TEXT NOT NULL, file TEXT NOT NULL UNIQUE, digest TEXT NOT NULL,
  PRIMARY KEY(job, kind));
CREATE TABLE pilots(job TEXT PRIMARY KEY REFERENCES jobs(id), report TEXT NOT NULL);
CREATE TABLE points(job TEXT NOT NULL, number BIGINT NOT NULL, point TEXT NOT NULL, PRIMARY KEY(job, number));
)sql";

/// What turns the tables of version 1 + i into those of the next.
constexpr const char* kMigrations[] = {
    // Jobs may be frames of a sequence.
    "CREATE TABLE sequences(number BIGSERIAL PRIMARY KEY, id TEXT NOT NULL UNIQUE, record TEXT NOT NULL)",
};
static_assert(std::size(kMigrations) == kSchemaVersion - 1);

/// Of the lock that those who make tables hold: "lightmil" in ASCII.
constexpr const char* kLockTables = "BEGIN; SELECT pg_advisory_xact_lock(7811887359634598252)";

}  // namespace

void prepare_postgres_schema(PostgresConnection& db, const std::string& shown) {
  const std::string encoding = db.execute("SHOW server_encoding").text(0, 0);
  if (encoding != "UTF8") {
    throw StoreError(shown + ": the database's encoding is " + encoding +
                     "; make one with createdb --encoding=UTF8 --template=template0");
  }
  db.execute(kLockTables);
  if (db.execute("SELECT to_regclass('meta') IS NULL").text(0, 0) == "t") {
    db.execute(kTables);
    db.query("INSERT INTO meta VALUES('schema', $1)", {std::to_string(kSchemaVersion)});
  } else {
    const PostgresResult found = db.execute("SELECT value::bigint FROM meta WHERE key='schema'");
    int64_t version = found.empty() ? 0 : found.integer(0, 0);
    if (version > kSchemaVersion) {
      throw StoreError(shown + ": a newer version of Lightmill wrote this job store (schema " +
                       std::to_string(version) + ", this one knows up to " + std::to_string(kSchemaVersion) +
                       "); use that version or a new database");
    }
    if (version < 1) {
      throw StoreError(shown + ": the job store has schema " + std::to_string(version) +
                       ", which is too old or damaged; use the version that wrote it or a new database");
    }
    for (; version < kSchemaVersion; ++version) db.execute(kMigrations[version - 1]);
    db.query("UPDATE meta SET value=$1 WHERE key='schema'", {std::to_string(kSchemaVersion)});
  }
  db.execute("COMMIT");
}

}  // namespace lightmill
