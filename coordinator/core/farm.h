#pragma once
// The coordinator's core behind one facade: jobs, tiles, leases, the durable ledger and the merge, in domain
// types. The gRPC services (coordinator/service/) translate to it. `lightmill render` embeds it with a memory
// store, so that local and distributed renders go through the same merge code.
//
// Thread-safe. The work is done by the classes that farm.cc lists; farm_state.h says which lock protects
// what.
//
//   Farm farm(std::make_unique<MemoryJobStore>(), clock, {});
//   JobId job = farm.submit({...});
//   WorkerId w = farm.register_worker({...});
//   if (auto grant = farm.lease(w)) farm.commit(w, {grant->job, grant->tile_id, grant->attempt}, bytes);
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/clock.h"
#include "common/base/ids.h"
#include "common/error/error_curve.h"
#include "common/farm/farm_types.h"
#include "common/farm/sequence_types.h"
#include "common/film/film.h"
#include "common/job/pilot_report.h"
#include "common/job/settings.h"
#include "common/scene/bundle.h"
#include "coordinator/core/farm_options.h"
#include "coordinator/core/farm_report.h"
#include "coordinator/farm/farm_errors.h"
#include "coordinator/farm/worker_table.h"

namespace lightmill {

class JobStore;  // coordinator/store/job_store.h: SQLite (WAL), PostgreSQL or memory

class Farm {
 public:
  using LeaseKey = lightmill::LeaseKey;

  Farm(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options);
  ~Farm();

  // --- clients ---
  JobId submit(const JobRequest& request);  // `after` may name sequences, too
  /// Of all jobs in the order of submission [begin, begin + count); less where there are not as many.
  /// Without `frames` those of sequences are left out of the answer.
  std::vector<JobStatus> jobs(size_t begin, size_t count, bool frames = true) const;
  /// The newest 1000.
  std::vector<JobStatus> jobs() const;
  size_t job_count() const;
  /// Of the jobs [begin, begin + count) in the order of submission those that changed after `version`, that
  /// are being rendered or, with `waiting`, that have not ended. Pages keep the farm's lock short. Without
  /// `frames` those of sequences are left out.
  JobPage page(size_t begin, size_t count, uint64_t version, bool waiting, bool frames = true) const;
  /// The tiles that are leased now, with their workers.
  std::vector<std::pair<WorkerId, LeaseKey>> holdings() const;
  /// The following throw Error(kFailed, "no job ...") for an unknown job.
  JobStatus job(const JobId& id) const;
  std::vector<TileStatus> tiles(const JobId& id) const;
  /// Of a job of any length no more than a few rounds.
  TileMap tile_map(const JobId& id) const;
  ErrorCurve curve(const JobId& id) const;
  /// What the job's pilot estimated and chose; empty if it had none, or none yet.
  std::optional<PilotReport> pilot(const JobId& id) const;
  Image image(const JobId& id) const;
  /// The same, to look at while tiles are missing (Film::resolve_for_display), or all are (show()).
  Image display_image(const JobId& id) const;
  /// Its AOVs, of the same samples as `image` (if given), which is filled; without channels if the job has
  /// none. `for_display`: of `image` missing tiles are filled in.
  ChannelImage aovs(const JobId& id, Image* image = nullptr, bool for_display = false) const;
  /// Its image and light groups: Film::light_groups_for_display.
  ChannelImage light_groups(const JobId& id, int block) const;
  /// Where the noise is: BatchFilm::error_map of the job's batches.
  Image error_map(const JobId& id) const;
  Bundle bundle(const std::string& bundle_digest) const;
  /// Digests of the bundles of all jobs that have not ended, ascending.
  std::vector<std::string> open_bundles() const;
  /// The bundle of a lease's job; empty if the worker does not hold the lease.
  std::string bundle_of(const WorkerId& worker, const LeaseKey& lease) const;
  /// Which file of a bundle the coordinator has lost, for people; empty: none. Its jobs say so. `in_vain`: a
  /// worker has asked for it, so they pause until it is back.
  void set_missing_file(const std::string& bundle_digest, const std::string& what, bool in_vain);
  void pause(const JobId& id);
  void resume(const JobId& id);
  void cancel(const JobId& id);
  void retry(const JobId& id);
  /// Of a job that has not ended; it counts from the next lease on.
  void set_priority(const JobId& id, int priority);
  /// New *totals*, in place of the old ones: without `spp` only the others stop the job.
  /// Reopens a finished job.
  void extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);
  // --- sequences; all but submit throw UnknownSequence ---
  /// A sequence with its first frames, at most kMaxFramesOfCall; add_frames adds the others.
  SequenceId submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames);
  /// A frame that is there with the same scene is left as it is, so that a call may be repeated. Throws
  /// Error(kUsage) if another frame has its number.
  void add_frames(const SequenceId& id, const std::vector<FrameRequest>& frames);
  SequenceStatus sequence(const SequenceId& id) const;
  /// In the order of submission [begin, begin + count); less where there are not as many.
  std::vector<SequenceStatus> sequences(size_t begin, size_t count) const;
  size_t sequence_count() const;
  /// At most so many frames with larger numbers than `after` (empty: the first ones) that have changed after
  /// `version`.
  FramePage frames(const SequenceId& id, std::optional<int> after, size_t most, uint64_t version) const;
  // These do to all frames what the methods of the same names do to a job. Frames whose state does not allow
  // it stay as they are; Error(kFailed) if that is all of them.
  void pause(const SequenceId& id);
  void resume(const SequenceId& id);
  void cancel(const SequenceId& id);
  void retry(const SequenceId& id);
  void set_priority(const SequenceId& id, int priority);
  void extend(const SequenceId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);
  /// Blocks until job(id).version > version or `timeout_s` passed; returns the newest status.
  JobStatus wait(const JobId& id, uint64_t version, double timeout_s) const;
  std::vector<WorkerStatus> workers() const;
  /// Some of them, see WorkerTable::page.
  WorkerPage workers(const WorkerId& after, size_t most) const;
  /// What at most `most` workers after `after` (empty: from the first) did in the last hour, of that what
  /// ends after the cell `since` (WorkerActivity).
  TimelinePage timelines(const WorkerId& after, size_t most, int64_t since) const;
  FarmStats stats() const;
  /// Jobs and sequences that ended and of which nobody was told yet, of at most so many; none without
  /// FarmOptions::tells_ends. They stay until told(), also after a restart.
  std::vector<EndNote> untold_ends(size_t most) const;
  void told(const EndNote& note);
  /// What an image file of the job should record: job, settings, samples, arithmetic class.
  std::map<std::string, std::string> image_metadata(const JobId& id) const;

  // --- workers ---
  /// Throws Error(kUnreachable) with a sentence if the build or schema does not fit, or no more may come.
  /// `owner`: whose token the worker came with, if any.
  WorkerId register_worker(const WorkerRegistration& registration, const std::string& owner = "");
  /// A worker was stopped at the door, before it could register: jobs that wait for one say why.
  void turned_away(const std::string& reason);
  /// Next tile for this worker, if any. Blocks up to `wait_s` for work. Throws Error(kUnreachable) for a
  /// worker that is not registered (after a restart): it registers again.
  std::optional<LeaseGrant> lease(const WorkerId& worker, double wait_s = 0);
  /// The same without waiting, for a thread that others need: what takes long, as the end of a job, is left
  /// to lease() and tick().
  std::optional<LeaseGrant> lease_at_once(const WorkerId& worker);
  /// Keeps the worker's leases alive; returns those (job, tile, attempt) that it has lost.
  std::vector<LeaseKey> renew(const WorkerId& worker, const std::vector<LeaseKey>& held);
  /// Takes an encoded partial, under a pilot's lease an encoded PilotResult, whose plan is then the job's.
  /// Durable once it returns kAccepted. A stale attempt is refused in the transaction that would merge it.
  /// `reason`, if given, receives why it was refused.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const std::string& partial_bytes,
                      std::string* reason = nullptr);
  /// The same but for the wait for the disk: kAccepted and kAlreadyCommitted must not leave this process
  /// before a flush() that was called later has returned.
  CommitResult commit_unflushed(const WorkerId& worker, const LeaseKey& lease,
                                const std::string& partial_bytes, std::string* reason = nullptr);
  /// Before a partial is sent: what its commit would be answered unless the worker holds the lease, as
  /// commit_unflushed() answers; otherwise the most encoded bytes that the tile's partial can have.
  std::variant<CommitResult, uint64_t> announce_commit(const WorkerId& worker, const LeaseKey& lease);
  /// Makes all durable that was committed before the call; calls at the same time share the work. Throws
  /// StoreError.
  void flush();
  /// The worker could not render the tile; leased again elsewhere, and after max_attempts the job fails: at
  /// once if the scene is at fault, or if no worker has enough memory (Scheduler::is_believed).
  void fail(const WorkerId& worker, const LeaseKey& lease, const std::string& reason,
            FailureKind kind = FailureKind::kTile);
  /// What light the job's image will lack, as the worker found that holds the lease; a pilot's report brings
  /// its own. Throws Error(kUsage) for more than kMaxMissingLight lines, none, or one of more than
  /// kMaxNoteBytes.
  void warn(const WorkerId& worker, const LeaseKey& lease, const std::vector<std::string>& missing_light);
  /// A picture of at most kMaxFirstLookSide pixels a side, which display_image() gives while the job has no
  /// samples. Of a pilot's lease alone. Throws Error(kUsage) for another size, or values that are not finite.
  void show(const WorkerId& worker, const LeaseKey& lease, Image picture);
  /// The worker has no time for the tile any more; leased again at once. A few times are nobody's fault, many
  /// are (WorkerTable::handed_back).
  void hand_back(const WorkerId& worker, const LeaseKey& lease);
  /// Whether it has delivered a tile; false for one that is not registered.
  bool is_proven(const WorkerId& worker) const;
  /// The worker takes no more leases; those it holds stay until committed or expired.
  void drain(const WorkerId& worker);
  /// Expires leases; called by a timer (and by lease()).
  void tick();
  /// Makes every waiting and later lease() and wait() return at once: the program is shutting down.
  void stop_waiting();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
