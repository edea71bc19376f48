#pragma once
// The workers that the coordinator knows: who may work, who is lost, who is benched. Pure: time
// is an argument.
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/farm/farm_types.h"

namespace lightmill {

struct Worker {
  WorkerId id;
  WorkerRegistration registration;
  std::string owner;  // whose token it came with; empty in plain text
  double last_seen = 0;
  bool asked = false;  // for a tile: what a real worker does at once
  int polling = 0;     // lease calls that wait right now: as good as being seen
  bool draining = false;
  bool convicted = false;  // of wrong pixels: all its tiles are checked from then on
  int64_t leases = 0;      // held now
  int64_t tiles_committed = 0;
  int64_t partials_refused = 0;
  double blame = 0;  // grows with failures and refused partials, shrinks with good ones
  int times_benched = 0;
  double benched_until = 0;
  double samples_per_second = 0;  // of its processors' time, smoothed; 0: not known yet
  // Of its newest tiles, the newest counting most: seconds from the lease, or from the tile before, to the
  // commit, and what its threads say that rendering took of a processor's time.
  double elapsed_seconds = 0, rendered_seconds = 0;
  double last_commit = 0;
  JobId last_job;    // of its newest lease
  int run_left = 0;  // tiles of that job that it gets before another one's turn
};

/// Of workers of one host that were turned away for one reason, the newest: those that are started again and
/// again, as services are, take one place.
struct RefusedWorker {
  WorkerId id;
  WorkerRegistration registration;  // without a host: it was stopped before it could say
  std::string reason;               // one line
  double at = 0;
};

/// What a worker says of itself, for a line that users read: at most 200 characters of it, in ASCII.
std::string printable(std::string text);

class WorkerTable {
 public:
  static constexpr size_t kMaxRefused = 32;  // the newest
  static constexpr double kRefusedKeptSeconds =
      600;  // by then whoever was turned away was mended, or has given up

  /// At most `max_workers` are registered and alive at once.
  WorkerTable(double lease_seconds, size_t max_workers)
      : lease_seconds_(lease_seconds), max_workers_(max_workers) {}

  /// Throws Error(kUnreachable) if as many live ones as may be are registered. Makes room by forgetting lost
  /// ones; then one that never asked for a tile; then, if another owner has more workers than this one, one
  /// of his that holds and has done nothing. Whoever is forgotten and alive registers again with its next
  /// call.
  void add(const WorkerId& id, const WorkerRegistration& registration, const std::string& owner, double now);
  /// Remembers a refusal for a while, for the user to see in the list of workers and in what waits for one.
  void add_refused(const WorkerId& id, const WorkerRegistration& registration, const std::string& reason,
                   double now);
  /// Who was turned away lately and why, a clause of a sentence; empty: nobody.
  std::string refusals(double now) const;
  /// Null if it is not registered.
  Worker* find(const WorkerId& id);
  const Worker* find(const WorkerId& id) const;
  void seen(const WorkerId& id, double now);
  bool is_lost(const Worker& worker, double now) const;
  /// May it get leases: neither lost nor draining nor benched.
  bool may_work(const Worker& worker, double now) const;
  /// A tile was rendered: `samples` pixel samples in `seconds` of each of its threads' processors. It had
  /// been leased at `since`.
  void committed(const WorkerId& id, double samples, double seconds, double since, double now);
  /// How much longer a tile takes than its processors' time, 1 or more: they may have other things to do.
  static double slowdown(const Worker& worker);
  /// A failure report. Too many bench the worker, twice as long every time until it has made up for all.
  void failed(const WorkerId& id, double now);
  /// A partial that no honest, sound worker sends: three weigh as much as eight failures.
  void refused(const WorkerId& id, double now);
  /// It rendered wrong pixels: benched for as long as anybody is.
  void convict(const WorkerId& id, double now);
  /// At most `most` (but all that were refused come with the last ones) after the worker `after`, empty: from
  /// the first.
  WorkerPage page(const WorkerId& after, size_t most, double now) const;
  const std::map<WorkerId, Worker>& all() const { return workers_; }

 private:
  void blame(Worker* worker, double weight, double now);
  bool make_room(const std::string& owner, double now);

  double lease_seconds_;
  size_t max_workers_;
  std::map<WorkerId, Worker> workers_;
  std::deque<RefusedWorker> refused_;  // the newest last
};

}  // namespace lightmill
