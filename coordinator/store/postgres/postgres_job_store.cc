#include "coordinator/store/postgres/postgres_job_store.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "common/base/digest.h"
#include "common/base/random_name.h"
#include "coordinator/store/data_folder.h"
#include "coordinator/store/image_bytes.h"
#include "coordinator/store/postgres/postgres_rows.h"

namespace lightmill {
namespace {

constexpr size_t kMaxProbeBytes = size_t{64} << 20;

}  // namespace

PostgresJobStore::PostgresJobStore(PostgresLease& lease, const std::string& folder, size_t chunk_bytes)
    : lease_(lease), db_(lease), files_(folder + "/layers"), chunk_bytes_(chunk_bytes) {
  claim_folder(folder);
  remove_orphans();
}

void PostgresJobStore::claim_folder(const std::string& folder) {
  const std::string path = folder + "/" + kSharedStoreId;
  std::string marked;
  std::ifstream(path) >> marked;
  const auto refuse = [&](const std::string& why) {
    throw StoreError("--data " + folder + ": " + why + " " + lease_.url().shown());
  };
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    const PostgresResult found = db.execute("SELECT value FROM meta WHERE key='folder'");
    if (!found.empty()) {
      if (marked.empty()) refuse("not the folder (is it mounted?) that holds the files of");
      if (marked != found.text(0, 0)) refuse("holds the files of another database than");
      return false;
    }
    // A crash between the two leaves a mark, and nothing else.
    if (!marked.empty() && !files_.empty()) refuse("holds the files of another database than");
    if (marked.empty()) write_file_atomically(path, (marked = random_name()) + "\n");
    db.query("INSERT INTO meta VALUES('folder', $1)", {marked});
    return true;
  });
}

void PostgresJobStore::remove_orphans() {
  db_.read([&](PostgresConnection& db) {
    const PostgresResult rows = db.execute("SELECT file FROM layers");
    std::set<std::string> named;
    for (int row = 0; row < rows.rows(); ++row) named.insert(rows.text(row, 0));
    files_.keep_only(named);
  });
}

void PostgresJobStore::flush() { db_.flush(); }

void PostgresJobStore::probe() {
  const size_t bytes = std::min(attempted_bytes_.load(), kMaxProbeBytes);
  files_.probe(bytes);
  db_.reconnect([&](PostgresConnection& db) {
    const std::string zeros(bytes, '\0');
    db.query("INSERT INTO spool(job, tile, part, bytes) VALUES('', 0, 0, $1)", {PostgresValue::bytes(zeros)});
    db.execute("DELETE FROM spool WHERE job=''");
    return true;
  });
}

std::vector<JobRecord> PostgresJobStore::jobs() {
  return db_.read([](PostgresConnection& db) {
    const PostgresResult rows = db.execute("SELECT id, record FROM jobs ORDER BY number");
    std::vector<JobRecord> records;
    records.reserve(static_cast<size_t>(rows.rows()));
    for (int row = 0; row < rows.rows(); ++row) {
      records.push_back(job_record_from_json(JobId{rows.text(row, 0)}, rows.text(row, 1)));
    }
    return records;
  });
}

std::vector<SequenceRecord> PostgresJobStore::sequences() {
  return db_.read([](PostgresConnection& db) {
    const PostgresResult rows = db.execute("SELECT id, record FROM sequences ORDER BY number");
    std::vector<SequenceRecord> records;
    for (int row = 0; row < rows.rows(); ++row)
      records.push_back(sequence_record_from_json(SequenceId{rows.text(row, 0)}, rows.text(row, 1)));
    return records;
  });
}

std::vector<TileRecord> PostgresJobStore::tiles(const JobId& job) {
  return db_.read(
      [&](PostgresConnection& db) { return postgres_rows::tiles(db, job, TileId{0}, kLastTile); });
}

std::optional<TileRecord> PostgresJobStore::tile(const JobId& job, TileId id) {
  const std::vector<TileRecord> found =
      db_.read([&](PostgresConnection& db) { return postgres_rows::tiles(db, job, id, id); });
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::vector<ErrorPoint> PostgresJobStore::curve(const JobId& job) {
  return db_.read([&](PostgresConnection& db) {
    const PostgresResult rows =
        db.query("SELECT point FROM points WHERE job=$1 ORDER BY number", {job.value});
    std::vector<ErrorPoint> points;
    for (int row = 0; row < rows.rows(); ++row) {
      for (const ErrorPoint& point : curve_from_json(rows.text(row, 0)).points) points.push_back(point);
    }
    return points;
  });
}

std::optional<std::string> PostgresJobStore::bundle_json(const std::string& digest) {
  return db_.read([&](PostgresConnection& db) -> std::optional<std::string> {
    const PostgresResult rows = db.query("SELECT manifest FROM bundles WHERE digest=$1", {digest});
    if (rows.empty()) return std::nullopt;
    return rows.text(0, 0);
  });
}

PostgresJobStore::Layer PostgresJobStore::put_file(const JobId& job, const std::string& kind,
                                                   std::string_view bytes) {
  attempted_bytes_ = bytes.size();
  // An older coordinator that wakes up late must not write into a file of ours.
  Layer layer{job.value + "-" + kind + "-" + std::to_string(lease_.epoch()) + "-" +
                  std::to_string(++next_file_) + "-" + random_name().substr(0, 8),
              sha256_hex(bytes)};
  files_.put(layer.file, bytes);
  return layer;
}

std::string PostgresJobStore::get_layer(const JobId& job, const std::string& kind) {
  const Layer layer = db_.read([&](PostgresConnection& db) {
    const PostgresResult rows =
        db.query("SELECT file, digest FROM layers WHERE job=$1 AND kind=$2", {job.value, kind});
    return rows.empty() ? Layer{} : Layer{rows.text(0, 0), rows.text(0, 1)};
  });
  return layer.file.empty() ? std::string() : files_.get(layer.file, layer.digest);
}

Image PostgresJobStore::reference(const JobId& job) {
  const std::lock_guard lock(layers_mutex_);
  const std::string bytes = get_layer(job, "reference");
  if (bytes.empty()) return {};
  Image image = image_from_bytes(bytes);
  if (image.data.empty()) {
    throw Error(ErrorKind::kFailed, "the reference image of job " + job.value + " is damaged");
  }
  return image;
}

std::string PostgresJobStore::pilot(const JobId& job) {
  return db_.read([&](PostgresConnection& db) {
    const PostgresResult rows = db.query("SELECT report FROM pilots WHERE job=$1", {job.value});
    return rows.empty() ? std::string() : rows.text(0, 0);
  });
}

LayerSnapshot PostgresJobStore::snapshot(const JobId& job) {
  const std::lock_guard lock(layers_mutex_);
  return {get_layer(job, "film"), get_layer(job, "batches")};
}

void PostgresJobStore::for_each_spooled(const JobId& job,
                                        const std::function<void(const std::string&)>& visit) {
  const auto tiles = db_.read([&](PostgresConnection& db) {
    return postgres_rows::ids(
        db.query("SELECT tile FROM spool WHERE job=$1 AND part=0 AND number > "
                 "COALESCE((SELECT number FROM folded WHERE job=$1), 0) ORDER BY tile",
                 {job.value}));
  });
  // One at a time: folding takes long, and others need the store meanwhile.
  for (const TileId tile : tiles) visit(partial(job, tile));
}

std::string PostgresJobStore::partial(const JobId& job, TileId tile) {
  return db_.read([&](PostgresConnection& db) {
    const PostgresResult rows = db.query_bytes(
        "SELECT bytes FROM spool WHERE job=$1 AND tile=$2 ORDER BY part", {job.value, tile.value});
    std::string bytes;
    for (int row = 0; row < rows.rows(); ++row) bytes += rows.bytes(row, 0);
    return bytes;
  });
}

std::vector<TileId> PostgresJobStore::kept_partials(const JobId& job) {
  return db_.read([&](PostgresConnection& db) {
    return postgres_rows::ids(
        db.query("SELECT tile FROM spool WHERE job=$1 AND part=0 ORDER BY tile", {job.value}));
  });
}

int64_t PostgresJobStore::next_number(const std::string& counter) {
  int64_t value = 0;
  db_.write(Durability::kFlush, [&](PostgresConnection& db) {
    value = db.query(
                  "INSERT INTO counters VALUES($1, 1) ON CONFLICT(name) DO UPDATE SET value = "
                  "counters.value + 1 RETURNING value",
                  {counter})
                .integer(0, 0);
    return true;
  });
  return value;
}

void PostgresJobStore::add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) {
  const Layer layer =
      reference.data.empty() ? Layer{} : put_file(job.id, "reference", image_to_bytes(reference));
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    postgres_rows::insert_job(db, job, bundle_json);
    if (!layer.file.empty()) postgres_rows::set_layer(db, job.id, "reference", layer.file, layer.digest);
    return true;
  });
}

void PostgresJobStore::save_job(const JobRecord& job) {
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    postgres_rows::update_job(db, job);
    return true;
  });
}

void PostgresJobStore::save_sequence(const SequenceRecord& sequence) {
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    db.query("INSERT INTO sequences(id, record) VALUES($1, $2) ON CONFLICT(id) DO UPDATE SET record=$2",
             {sequence.id.value, sequence_record_to_json(sequence)});
    return true;
  });
}

void PostgresJobStore::add_jobs(const std::vector<NewJob>& jobs) {
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    for (const NewJob& job : jobs) postgres_rows::insert_job(db, job.record, job.bundle_json);
    return true;
  });
}

void PostgresJobStore::save_jobs(const std::vector<JobRecord>& jobs) {
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    for (const JobRecord& job : jobs) postgres_rows::update_job(db, job);
    return true;
  });
}

void PostgresJobStore::add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) {
  db_.write(Durability::kFlush, [&](PostgresConnection& db) {
    postgres_rows::insert_tiles(db, job, tiles);
    return true;
  });
}

void PostgresJobStore::split_tile(const JobId& job, const TileRecord& smaller,
                                  const std::vector<TileRecord>& others) {
  const CellRect& c = smaller.tile.cells;
  db_.write(Durability::kFlush, [&](PostgresConnection& db) {
    const PostgresResult done =
        db.query("UPDATE tiles SET x0=$1, y0=$2, x1=$3, y1=$4 WHERE job=$5 AND tile=$6 AND state=0",
                 {c.x0, c.y0, c.x1, c.y1, job.value, smaller.id.value});
    if (done.changes() != 1) throw std::logic_error("store: only a pending tile can be split");
    postgres_rows::insert_tiles(db, job, others);
    return true;
  });
}

void PostgresJobStore::save_tile(const JobRecord& job, const TileRecord& tile) {
  db_.write(Durability::kFlush, [&](PostgresConnection& db) {
    postgres_rows::update_tile(db, job.id, tile);
    postgres_rows::update_job(db, job);
    return true;
  });
}

bool PostgresJobStore::commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) {
  attempted_bytes_ = partial.size();
  return db_.write(Durability::kFlush, [&](PostgresConnection& db) {
    if (!postgres_rows::mark_committed(db, job, tile)) return false;
    int64_t part = 0;
    for (size_t at = 0; at < partial.size(); at += chunk_bytes_) {
      db.query("INSERT INTO spool(job, tile, part, bytes) VALUES($1, $2, $3, $4)",
               {job.id.value, tile.id.value, part++, PostgresValue::bytes(partial.substr(at, chunk_bytes_))});
    }
    return true;
  });
}

bool PostgresJobStore::commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) {
  const std::string text(report);
  return db_.write(Durability::kNow, [&](PostgresConnection& db) {
    if (!postgres_rows::mark_committed(db, job, pilot)) return false;
    db.query("INSERT INTO pilots VALUES($1, $2) ON CONFLICT(job) DO UPDATE SET report = excluded.report",
             {job.id.value, text});
    return true;
  });
}

void PostgresJobStore::add_point(const JobId& job, const ErrorPoint& point) {
  const std::string text = curve_to_json({"", {point}});
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    db.query("INSERT INTO points SELECT $1, COALESCE(MAX(number), 0) + 1, $2 FROM points WHERE job=$1",
             {job.value, text});
    return true;
  });
}

std::vector<std::string> PostgresJobStore::snapshot_files(PostgresConnection& db, const JobId& job) {
  const PostgresResult rows =
      db.query("SELECT file FROM layers WHERE job=$1 AND kind IN ('film', 'batches')", {job.value});
  std::vector<std::string> files;
  files.reserve(static_cast<size_t>(rows.rows()));
  for (int row = 0; row < rows.rows(); ++row) files.push_back(rows.text(row, 0));
  return files;
}

void PostgresJobStore::mark_folded(PostgresConnection& db, const JobId& job) {
  db.query(
      "INSERT INTO folded SELECT $1, MAX(number) FROM spool WHERE job=$1 HAVING MAX(number) > 0 "
      "ON CONFLICT(job) DO UPDATE SET number = excluded.number",
      {job.value});
}

void PostgresJobStore::checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) {
  const Layer film = put_file(job, "film", snapshot.film);
  const Layer batches = put_file(job, "batches", snapshot.batches);
  // If the transaction fails it may stand nevertheless: the files stay, until the next start if it does not.
  const std::lock_guard lock(layers_mutex_);
  std::vector<std::string> replaced;
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    replaced = snapshot_files(db, job);
    postgres_rows::set_layer(db, job, "film", film.file, film.digest);
    postgres_rows::set_layer(db, job, "batches", batches.file, batches.digest);
    if (keep_partials) {
      mark_folded(db, job);
    } else {
      db.query("DELETE FROM spool WHERE job=$1", {job.value});
      db.query("DELETE FROM folded WHERE job=$1", {job.value});
    }
    return true;
  });
  for (const std::string& file : replaced) files_.remove(file);
}

void PostgresJobStore::take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                                 const LayerSnapshot& rest) {
  const bool has_rest = !rest.film.empty();
  const Layer film = has_rest ? put_file(job.id, "film", rest.film) : Layer{};
  const Layer batches = has_rest ? put_file(job.id, "batches", rest.batches) : Layer{};
  const std::lock_guard lock(layers_mutex_);
  std::vector<std::string> replaced;
  db_.write(Durability::kNow, [&](PostgresConnection& db) {
    for (const TileRecord& tile : tiles) {
      postgres_rows::update_tile(db, job.id, tile);
      db.query("DELETE FROM spool WHERE job=$1 AND tile=$2", {job.id.value, tile.id.value});
    }
    replaced = snapshot_files(db, job.id);
    db.query("DELETE FROM layers WHERE job=$1 AND kind IN ('film', 'batches')", {job.id.value});
    db.query("DELETE FROM folded WHERE job=$1", {job.id.value});
    if (has_rest) {
      postgres_rows::set_layer(db, job.id, "film", film.file, film.digest);
      postgres_rows::set_layer(db, job.id, "batches", batches.file, batches.digest);
      mark_folded(db, job.id);
    }
    db.query("DELETE FROM points WHERE job=$1", {job.id.value});
    postgres_rows::update_job(db, job);
    return true;
  });
  for (const std::string& file : replaced) files_.remove(file);
}

}  // namespace lightmill
