#pragma once
// The workers that the coordinator knows: which may work, which are lost, which are benched. Pure: time is an
// argument.
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/farm/farm_types.h"
#include "coordinator/farm/activity/worker_activity.h"

namespace lightmill {

struct Worker {
  WorkerId id;
  WorkerRegistration registration;
  std::string owner;  // whose token it came with; empty in plain text
  double last_seen = 0;
  bool asked = false;  // asked for a tile, as a real worker does at once
  int polling = 0;     // waiting lease calls: they count as being seen
  bool draining = false;
  bool convicted = false;  // of wrong pixels: all its tiles are checked from then on
  int64_t leases = 0;      // held now
  int64_t tiles_committed = 0;
  int64_t partials_refused = 0;
  double blame = 0;  // grows with failures and refused partials, shrinks with good ones
  int times_benched = 0;
  double benched_until = 0;
  double samples_per_second = 0;  // of its processors' time, smoothed; 0: not known yet
  // Of its newest tiles, the newest counting most: seconds to the commit from the lease or from the tile
  // before, and the processor seconds of rendering by its threads' account.
  double elapsed_seconds = 0, rendered_seconds = 0;
  double last_commit = 0;
  JobId last_job;    // of its newest lease
  int run_left = 0;  // tiles of that job that it gets before another one's turn
  WorkerActivity activity;
};

/// What a worker did lately.
struct WorkerTimeline {
  WorkerId id;
  double present_seconds = 0, busy_seconds = 0;  // of the last hour
  std::vector<WorkerActivity::Span> spans;
};
/// Of some workers, in the order of their ids.
struct TimelinePage {
  std::vector<WorkerTimeline> workers;
  WorkerId last;           // the next page begins after it; empty: there is none
  int64_t cell = 0;        // the present one
  double cell_origin = 0;  // when cell 0 began, seconds since 1970
};

/// The newest of a host's workers that were turned away for the same reason. Services that are started again
/// and again take one place.
struct RefusedWorker {
  WorkerId id;
  WorkerRegistration registration;  // without a host: stopped before it could name it
  std::string reason;               // one line
  double at = 0;
};

/// A worker's text about itself, for a line that users read: at most 200 characters of it, in ASCII.
std::string printable(std::string text);

class WorkerTable {
 public:
  static constexpr size_t kMaxRefused = 32;  // the newest
  static constexpr double kRefusedKeptSeconds =
      600;  // by then whoever was turned away was mended, or has given up

  /// At most `max_workers` are registered and alive at once.
  WorkerTable(double lease_seconds, size_t max_workers)
      : lease_seconds_(lease_seconds), max_workers_(max_workers) {}

  /// Throws Error(kUnreachable) if max_workers live workers are registered. To make room it forgets lost
  /// workers; then one that never asked for a tile; then, if another owner has more workers than this one,
  /// one of that owner's that holds nothing and has done nothing. A live worker that was forgotten registers
  /// again with its next call.
  void add(const WorkerId& id, const WorkerRegistration& registration, const std::string& owner, double now);
  /// Remembers a refusal for a while: it shows in the list of workers, and in the notes of jobs that wait for
  /// one.
  void add_refused(const WorkerId& id, const WorkerRegistration& registration, const std::string& reason,
                   double now);
  /// Which workers were turned away lately and why, a clause of a sentence; empty: none.
  std::string refusals(double now) const;
  /// Null if it is not registered.
  Worker* find(const WorkerId& id);
  const Worker* find(const WorkerId& id) const;
  void seen(const WorkerId& id, double now);
  bool is_lost(const Worker& worker, double now) const;
  /// Whether it has said anything for a lease time.
  bool was_heard(const Worker& worker, double now) const;
  /// Whether it may get leases: it is neither lost nor draining nor benched.
  bool may_work(const Worker& worker, double now) const;
  /// It has delivered something, so that it is no mere name.
  static bool is_proven(const Worker& worker) { return worker.tiles_committed > 0; }
  /// Leases that it may hold at once: enough to keep its threads busy from one tile to the next.
  static int64_t most_leases(const Worker& worker);
  /// A lease of a job's tile begins, or has ended, `delivered` or for nothing. Of workers that are forgotten
  /// nothing is counted.
  void leased(const WorkerId& id, const JobId& job, double now);
  void released(const WorkerId& id, const JobId& job, bool delivered, double now);
  /// A tile, leased at `since`, was rendered: `samples` pixel samples in `seconds` of each of its threads'
  /// processors.
  void committed(const WorkerId& id, double samples, double seconds, double since, double now);
  /// Time of a tile over its processors' time, 1 or more: they may have other things to do.
  static double slowdown(const Worker& worker);
  /// It held a lease for far too long, or let one run out. It counts as a failure, and much more for a worker
  /// that has never delivered anything.
  void undelivered(const WorkerId& id, double now);
  /// It gave a lease back unrendered. Half a failure: who leaves does so a few times, who plays does for
  /// ever.
  void handed_back(const WorkerId& id, double now);
  /// A failure report. Too many of them bench the worker, each time for twice as long, until it has made up
  /// for all.
  void failed(const WorkerId& id, double now);
  /// It sent a partial that no honest, sound worker sends. Three weigh as much as eight failures.
  void refused(const WorkerId& id, double now);
  /// It rendered wrong pixels: it is benched for the longest time.
  void convict(const WorkerId& id, double now);
  /// At most `most` workers after the worker `after` (empty: from the first). All that were refused come with
  /// the last ones, beyond `most`.
  WorkerPage page(const WorkerId& after, size_t most, double now) const;
  const std::map<WorkerId, Worker>& all() const { return workers_; }
  /// What at most `most` workers after `after` (empty: from the first) did lately (WorkerActivity::spans).
  TimelinePage timelines(const WorkerId& after, size_t most, int64_t since, double now);

 private:
  void blame(Worker* worker, double weight, double now);
  bool make_room(const std::string& owner, double now);

  double lease_seconds_;
  size_t max_workers_;
  std::map<WorkerId, Worker> workers_;
  std::deque<RefusedWorker> refused_;  // the newest last
};

}  // namespace lightmill
