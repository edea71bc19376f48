#pragma once
// A worker without a renderer, for tests of the farm: its pixels are a hash of (pixel, sample), so that any
// tiling must add up to the same film.
#include <functional>
#include <string>

#include "common/film/film.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/job_store.h"

namespace lightmill::testing {

inline constexpr int kFakeQuantum = -40;

/// The partial of a tile; camera and splat layers as the strategies have them. `cpu_seconds` as given.
Partial fake_partial(const TileSpec& tile, const RenderSettings& settings, double cpu_seconds = 0.1);
/// What a good worker commits: a partial, or the result of the pilot.
std::string fake_bytes(const LeaseGrant& grant, double cpu_seconds = 0.1);

/// What every pilot finds here: no light paths.
PilotReport fake_pilot();
/// The job's settings once its pilot, if it needs one, has chosen.
RenderSettings after_pilot(RenderSettings settings);

/// The film of the whole job, rendered as one tile.
Image fake_image(const RenderSettings& settings);

RenderSettings small_settings(int width, int height, int64_t spp, Integrator integrator = Integrator::kBdpt);
Bundle fake_bundle();
JobRequest small_job(int width, int height, int64_t spp, Integrator integrator = Integrator::kBdpt);
WorkerRegistration registration(const std::string& arithmetic_class = "class-a",
                                const std::string& pool = "");
FarmOptions fake_options();

/// Leases and commits until there is nothing left for `worker`; at most `limit` tiles. Returns how many.
int work(Farm& farm, const WorkerId& worker, int limit = 1 << 20);

bool same_pixels(const Image& a, const Image& b);

/// Forwards to another store and calls `before_write` with the number of the write, from 1, before each one.
class WatchedStore : public JobStore {
 public:
  WatchedStore(JobStore& store, std::function<void(int)> before_write)
      : store_(store), before_write_(std::move(before_write)) {}
  std::vector<JobRecord> jobs() override { return store_.jobs(); }
  std::vector<SequenceRecord> sequences() override { return store_.sequences(); }
  std::vector<TileRecord> tiles(const JobId& job) override { return store_.tiles(job); }
  std::optional<TileRecord> tile(const JobId& job, TileId id) override { return store_.tile(job, id); }
  std::vector<ErrorPoint> curve(const JobId& job) override { return store_.curve(job); }
  std::optional<std::string> bundle_json(const std::string& d) override { return store_.bundle_json(d); }
  Image reference(const JobId& job) override { return store_.reference(job); }
  std::string pilot(const JobId& job) override { return store_.pilot(job); }
  LayerSnapshot snapshot(const JobId& job) override { return store_.snapshot(job); }
  void for_each_spooled(const JobId& job, const std::function<void(const std::string&)>& visit) override {
    store_.for_each_spooled(job, visit);
  }
  std::vector<TileId> kept_partials(const JobId& job) override { return store_.kept_partials(job); }
  std::string partial(const JobId& job, TileId tile) override { return store_.partial(job, tile); }
  int64_t next_number(const std::string& counter) override { return write(), store_.next_number(counter); }
  void add_job(const JobRecord& j, const std::string& b, const Image& r) override {
    write(), store_.add_job(j, b, r);
  }
  void save_job(const JobRecord& job) override { write(), store_.save_job(job); }
  void save_sequence(const SequenceRecord& s) override { write(), store_.save_sequence(s); }
  void add_jobs(const std::vector<NewJob>& jobs) override { write(), store_.add_jobs(jobs); }
  void save_jobs(const std::vector<JobRecord>& jobs) override { write(), store_.save_jobs(jobs); }
  void add_tiles(const JobId& job, const std::vector<TileRecord>& t) override {
    write(), store_.add_tiles(job, t);
  }
  void split_tile(const JobId& job, const TileRecord& smaller, const std::vector<TileRecord>& o) override {
    write(), store_.split_tile(job, smaller, o);
  }
  void save_tile(const JobRecord& job, const TileRecord& tile) override {
    write(), store_.save_tile(job, tile);
  }
  bool commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) override {
    return write(), store_.commit_tile(job, tile, partial);
  }
  bool commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) override {
    return write(), store_.commit_pilot(job, pilot, report);
  }
  void flush() override { write(), store_.flush(); }
  void add_point(const JobId& job, const ErrorPoint& point) override {
    write(), store_.add_point(job, point);
  }
  void checkpoint(const JobId& job, const LayerSnapshot& s, bool keep) override {
    write(), store_.checkpoint(job, s, keep);
  }
  void take_back(const JobRecord& job, const std::vector<TileRecord>& t, const LayerSnapshot& s) override {
    write(), store_.take_back(job, t, s);
  }
  void probe() override { write(), store_.probe(); }

 private:
  void write() { before_write_(++writes_); }
  JobStore& store_;
  std::function<void(int)> before_write_;
  int writes_ = 0;
};

/// A folder that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace lightmill::testing
