#pragma once
// The scheduler: which tile for which worker, when to open a round, when a job is complete. Pure: it decides
// on (state, now) and never waits, stores or renders; the farm makes a decision durable and then applies it.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "coordinator/farm/job_index.h"
#include "coordinator/farm/job_tail.h"
#include "coordinator/farm/round_planner.h"
#include "coordinator/farm/scheduler_options.h"
#include "coordinator/farm/sharing/fair_share.h"
#include "coordinator/farm/sharing/film_admission.h"
#include "coordinator/farm/sharing/turn_key.h"
#include "coordinator/farm/worker_table.h"

namespace lightmill {

/// Lease this tile; one that is leased already is raced for.
struct LeaseOffer {
  JobId job;
  TileId tile;
};
/// Lease this committed tile, to compare.
struct CheckOffer {
  JobId job;
  TileId tile;
};
/// Cut this pending tile into parts, then ask again.
struct SplitOffer {
  JobId job;
  TileId tile;
  std::vector<CellRect> parts;
};
/// Open this round (or the pilot), then ask again.
struct RoundOffer {
  JobId job;
  std::vector<TileSpec> tiles;
};
using Offer = std::variant<std::monostate, LeaseOffer, CheckOffer, SplitOffer, RoundOffer>;

/// A job that a worker may work for, and what it is ordered by.
struct Turn {
  TurnKey key;
  const Job* job;
};

class Scheduler {
 public:
  explicit Scheduler(const SchedulerOptions& options)
      : workers(options.lease_seconds, options.max_workers),
        options_(options),
        rounds_(workers, options),
        tail_(workers, options),
        admission_(options.film_memory_bytes) {}
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  WorkerTable workers;
  JobIndex jobs;

  Job& add(Job job);
  /// Takes the job, or the sequence, out of the sharing, before its priority changes; it joins again, beside
  /// its new equals, when the next worker asks.
  void withdraw(Job& job);
  void withdraw(Sequence& sequence);
  /// To be called after record.state, or what else is_runnable() goes by, was changed.
  void state_changed(Job& job);

  /// What the clock lacks of the seconds since 1970.
  double unix_offset() const { return options_.unix_offset; }

  /// What to do for a worker that asks for work: a tile of the runnable job of highest priority that has (or
  /// can open) something for it; of equal ones the one that has had least (fair_share.h) of those whose films
  /// are in memory together (film_admission.h). A worker gets several tiles of a job in a row, so that
  /// neither its scenes nor the films change with every tile, but a job that has just come begins at once.
  /// When a job comes to its end, pending tiles are cut for those who idle, and then they race those who are
  /// late; those who are very late are raced in the job's turn, too. Nobody gets more than
  /// WorkerTable::most_leases().
  Offer offer(const WorkerId& worker, double now);
  /// To be called when what was offered is leased, and when a lease has ended after `seconds` of processor
  /// time; 0 if it came to nothing.
  void granted(Job& job, const TileRecord& tile);
  void settled(Job& job, TileId tile, int64_t attempt, double seconds);
  /// Leases that have lasted for too long (JobTail::overdue).
  std::vector<LeaseTable::Lease> overdue(const Job& job, double undisturbed_since, double now) const {
    return tail_.overdue(job, undisturbed_since, now);
  }
  /// Whether reports that the job, or this tile, can't be rendered are to be believed. Those of two workers
  /// that have delivered something are, but not those of mere names, as long as there is anybody else to try.
  bool is_believed(const Job& job, TileId tile, double now) const;
  /// True if nothing is left to lease or to wait for: the job is done.
  bool complete(const Job& job, double now) const;
  /// The same, but for spot checks.
  bool rendered(const Job& job, double now) const;
  /// True if a worker is there, maybe benched, that could check the tile.
  bool has_checker(const Job& job, TileId tile, double now) const;
  /// "is expected about 12 min after its deadline"; empty if it is in time, or that is not known.
  std::string deadline_note(const Job& job, double now) const;

  /// The jobs that the worker may work for, the one that comes next first.
  std::vector<Turn> turns(const Worker& worker, double now) const;
  /// Of `turns` the job that the worker would get a tile of; null: none has one for it.
  const Job* next_served(const std::vector<Turn>& turns, const Worker& worker, double now) const;
  /// Whether the job's film is in memory, or may come there now.
  bool has_room(const Job& job, double now) const;
  /// What the job's time is counted in: its own share, or its sequence's.
  const JobShare& share_of(const Job& job) const;

 private:
  bool wants_workers(const Job& job) const;
  bool wants_workers(const Sequence& sequence) const;
  JobShare& share_of(Job& job);
  /// Takes part in the sharing, or ends that.
  void compete(Job& job, bool wants);
  /// All jobs and sequences compete that want workers, and no others.
  void update_competing();
  void add_single(const Job& job, const Worker& worker, std::vector<Turn>* fitting) const;
  void add_frames(const Sequence& sequence, const Worker& worker, std::vector<Turn>* fitting) const;
  /// When a job that will miss its deadline is to be done, clock time; of all others infinity.
  double late_deadline(const Job& job, double now) const;
  FilmAdmission::Claim claim(const Job& job) const;
  /// turns(), but that the worker goes on with the job that it is at, for a while.
  std::vector<Turn> candidates(const Worker& worker, double now);
  Offer offer_of(const Job& job, const Worker& worker, double now) const;
  /// What is offered, and of which job.
  struct Found {
    const Job* job;
    Offer offer;
  };
  /// The first offer of those whose films are in memory, or that `may_take(job)` lets in; then of the others:
  /// rather a film from the disk than an idle worker.
  template <class MayTake>
  std::optional<Found> first_offer(const std::vector<Turn>& turns, const Worker& worker, double now,
                                   MayTake may_take) const;

  SchedulerOptions options_;
  RoundPlanner rounds_;
  JobTail tail_;
  FairShare shares_;
  FilmAdmission admission_;
};

}  // namespace lightmill
