#include "coordinator/store/sqlite/sqlite_job_store.h"

#include <algorithm>

#include "coordinator/store/image_bytes.h"
#include "coordinator/store/sqlite/sqlite_rows.h"
#include "coordinator/store/sqlite/sqlite_schema.h"

namespace lightmill {
namespace {

constexpr size_t kMaxProbeBytes = size_t{64} << 20;

}  // namespace

SqliteJobStore::SqliteJobStore(const std::string& path, size_t chunk_bytes)
    : db_(path), path_(path), chunk_bytes_(chunk_bytes) {
  prepare_sqlite_schema(db_, path_);
  // The log is there, with its name in the folder, before anybody flushes it; and a disk that can't be
  // written is noticed now.
  Transaction transaction(db_);
  db_.execute("INSERT INTO meta VALUES('opened', 1) ON CONFLICT(key) DO UPDATE SET value = value + 1");
  transaction.commit();
}

std::vector<JobRecord> SqliteJobStore::jobs() {
  const std::lock_guard lock(mutex_);
  std::vector<JobRecord> records;
  Statement select(db_, "SELECT id, record FROM jobs ORDER BY number");
  while (select.step()) records.push_back(job_record_from_json(JobId{select.text(0)}, select.text(1)));
  return records;
}

std::vector<SequenceRecord> SqliteJobStore::sequences() {
  const std::lock_guard lock(mutex_);
  std::vector<SequenceRecord> records;
  Statement select(db_, "SELECT id, record FROM sequences ORDER BY number");
  while (select.step())
    records.push_back(sequence_record_from_json(SequenceId{select.text(0)}, select.text(1)));
  return records;
}

std::vector<TileRecord> SqliteJobStore::tiles(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return sqlite_rows::tiles(db_, path_, job, TileId{0}, kLastTile);
}

std::optional<TileRecord> SqliteJobStore::tile(const JobId& job, TileId id) {
  const std::lock_guard lock(mutex_);
  const std::vector<TileRecord> found = sqlite_rows::tiles(db_, path_, job, id, id);
  return found.empty() ? std::nullopt : std::optional(found.front());
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

Image SqliteJobStore::reference(const JobId& job) {
  const std::lock_guard lock(mutex_);
  const std::string bytes = sqlite_rows::layer(db_, job, "reference");
  if (bytes.empty()) return {};
  Image image = image_from_bytes(bytes);
  if (image.data.empty())
    throw StoreError(path_ + ": the reference image of job " + job.value + " is damaged");
  return image;
}

std::string SqliteJobStore::pilot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return sqlite_rows::layer(db_, job, "pilot");
}

LayerSnapshot SqliteJobStore::snapshot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return {sqlite_rows::layer(db_, job, "film"), sqlite_rows::layer(db_, job, "batches")};
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
  Transaction transaction(db_, Durability::kFlush);
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
  ++written_;
  return value;
}

void SqliteJobStore::add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  insert_job(job, bundle_json);
  if (!reference.data.empty()) set_layer(job.id, "reference", image_to_bytes(reference));
  transaction.commit();
}

void SqliteJobStore::insert_job(const JobRecord& job, const std::string& bundle_json) {
  Statement(db_, "INSERT OR IGNORE INTO bundles VALUES(?,?)").bind(job.bundle_digest).bind(bundle_json).run();
  Statement(db_, "INSERT INTO jobs(id, bundle, record) VALUES(?,?,?)")
      .bind(job.id.value)
      .bind(job.bundle_digest)
      .bind(job_record_to_json(job))
      .run();
}

SqliteJobStore::LeasedState SqliteJobStore::leased_state(const JobRecord& job) {
  return {job.state, job.arithmetic_class, job.leases_reassigned};
}

void SqliteJobStore::write_job(const JobRecord& job) {
  rows_.erase(job.id);  // whether it gets there is not known yet
  sqlite_rows::update_job(db_, job);
}

void SqliteJobStore::set_layer(const JobId& job, const std::string& kind, std::string_view bytes) {
  sqlite_rows::set_layer(db_, job, kind, bytes, chunk_bytes_);
}

void SqliteJobStore::save_job(const JobRecord& job) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  write_job(job);
  transaction.commit();
}

void SqliteJobStore::save_sequence(const SequenceRecord& sequence) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  Statement(db_, "INSERT INTO sequences(id, record) VALUES(?1,?2) ON CONFLICT(id) DO UPDATE SET record=?2")
      .bind(sequence.id.value)
      .bind(sequence_record_to_json(sequence))
      .run();
  transaction.commit();
}

void SqliteJobStore::add_jobs(const std::vector<NewJob>& jobs) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  for (const NewJob& job : jobs) insert_job(job.record, job.bundle_json);
  transaction.commit();
}

void SqliteJobStore::save_jobs(const std::vector<JobRecord>& jobs) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  for (const JobRecord& job : jobs) write_job(job);
  transaction.commit();
}

void SqliteJobStore::add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_, Durability::kFlush);
  sqlite_rows::insert_tiles(db_, job, tiles);
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
  sqlite_rows::insert_tiles(db_, job, others);
  transaction.commit();
  ++written_;
}

void SqliteJobStore::save_tile(const JobRecord& job, const TileRecord& tile) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_, Durability::kFlush);
  sqlite_rows::update_tile(db_, job.id, tile);
  // Most leases change nothing of the job but its wall time, which the next commit writes.
  const auto row = rows_.find(job.id);
  if (row == rows_.end() || !(row->second == leased_state(job))) write_job(job);
  transaction.commit();
  rows_.insert_or_assign(job.id, leased_state(job));
  ++written_;
}

bool SqliteJobStore::commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  rows_.erase(job.id);
  if (!sqlite_rows::mark_committed(db_, job, pilot)) return false;
  set_layer(job.id, "pilot", report);
  transaction.commit();
  return true;
}

bool SqliteJobStore::commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) {
  const std::lock_guard lock(mutex_);
  attempted_bytes_ = partial.size();
  Transaction transaction(db_, Durability::kFlush);
  rows_.erase(job.id);
  if (!sqlite_rows::mark_committed(db_, job, tile)) return false;
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

void SqliteJobStore::mark_folded(const JobId& job) {
  Statement(db_,
            "INSERT OR REPLACE INTO folded SELECT ?1, MAX(rowid) FROM spool WHERE job=?1 HAVING MAX(rowid)")
      .bind(job.value)
      .run();
}

void SqliteJobStore::checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) {
  const std::lock_guard lock(mutex_);
  attempted_bytes_ = snapshot.film.size() + snapshot.batches.size();
  Transaction transaction(db_);
  set_layer(job, "film", snapshot.film);
  set_layer(job, "batches", snapshot.batches);
  if (keep_partials) {
    mark_folded(job);
  } else {
    Statement(db_, "DELETE FROM spool WHERE job=?").bind(job.value).run();
    Statement(db_, "DELETE FROM folded WHERE job=?").bind(job.value).run();
  }
  transaction.commit();
}

void SqliteJobStore::take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                               const LayerSnapshot& rest) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(db_);
  for (const TileRecord& tile : tiles) {
    sqlite_rows::update_tile(db_, job.id, tile);
    Statement(db_, "DELETE FROM spool WHERE job=? AND tile=?").bind(job.id.value).bind(tile.id.value).run();
  }
  set_layer(job.id, "film", rest.film);
  set_layer(job.id, "batches", rest.batches);
  Statement(db_, "DELETE FROM folded WHERE job=?").bind(job.id.value).run();
  if (!rest.film.empty()) mark_folded(job.id);
  Statement(db_, "DELETE FROM points WHERE job=?").bind(job.id.value).run();
  write_job(job);
  transaction.commit();
}

}  // namespace lightmill
