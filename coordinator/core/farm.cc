#include "coordinator/core/farm.h"

#include <cstdint>
#include <mutex>
#include <utility>

#include "coordinator/core/commit_path.h"
#include "coordinator/core/end_news.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/farm_view.h"
#include "coordinator/core/job_desk.h"
#include "coordinator/core/job_results.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/leases.h"
#include "coordinator/core/repair/film_repair.h"
#include "coordinator/core/repair/scene_files.h"
#include "coordinator/core/repair/storage_guard.h"
#include "coordinator/core/round_ends.h"
#include "coordinator/core/sequences/budget_keeper.h"
#include "coordinator/core/sequences/sequence_desk.h"
#include "coordinator/core/sequences/sequence_view.h"
#include "coordinator/core/spot_checks.h"
#include "coordinator/core/worker_desk.h"

namespace lightmill {

/// The parts, each of which uses only those above it. Farm's methods pass calls on.
struct Farm::Impl {
  Impl(std::unique_ptr<JobStore> job_store, const Clock& clock, const FarmOptions& options)
      : state(std::move(job_store), clock, options) {}

  FarmState state;                                           // what they share, and its lock
  JobTable jobs{state};                                      // jobs and ledgers, in memory as in the store
  StorageGuard storage{state, jobs};                         // pauses while the disk fails
  Leases leases{state, jobs};                                // who renders what, until when
  RoundEnds ends{state, jobs, storage};                      // error curve, stop rules, the end of a job
  SpotChecks checks{state, jobs, storage, leases, ends};     // tiles rendered twice; liars
  FilmRepair repair{state, jobs, leases};                    // films that the disk has damaged
  CommitPath commits{state, storage, leases, ends, checks};  // a partial's way into the film
  JobDesk clients{state, jobs, ends};                        // what clients do to jobs
  SequenceDesk sequences{state, jobs, ends, clients};        // and to sequences
  BudgetKeeper budgets{state, jobs, clients};                // more samples where the error falls most
  WorkerDesk workers{state, jobs, leases, ends};             // what workers ask for
  SceneFiles files{state};                                   // jobs whose scene files are lost
  FarmView view{state, jobs};                                // states of jobs, tiles, workers
  SequenceView sequence_view{state, jobs, view};             // and of sequences
  JobResults results{state, jobs, storage, view};            // images, curves, reports
  EndNews news{state, jobs};                                 // ends that hooks are to be told
};

Farm::Farm(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options)
    : impl_(std::make_unique<Impl>(std::move(store), clock, options)) {
  impl_->ends.settle_complete();
}
Farm::~Farm() = default;

// --- clients ---

JobId Farm::submit(const JobRequest& request) { return impl_->clients.submit(request); }
void Farm::pause(const JobId& id) { impl_->clients.pause(id); }
void Farm::resume(const JobId& id) { impl_->clients.resume(id); }
void Farm::cancel(const JobId& id) { impl_->clients.cancel(id); }
void Farm::retry(const JobId& id) { impl_->clients.retry(id); }
void Farm::set_priority(const JobId& id, int priority) { impl_->clients.set_priority(id, priority); }
void Farm::extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                  std::optional<double> target_error) {
  impl_->clients.extend(id, spp, time_s, target_error);
}

SequenceId Farm::submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames) {
  return impl_->sequences.submit(request, frames);
}
void Farm::add_frames(const SequenceId& id, const std::vector<FrameRequest>& frames) {
  impl_->sequences.add_frames(id, frames);
}
void Farm::pause(const SequenceId& id) { impl_->sequences.pause(id); }
void Farm::resume(const SequenceId& id) { impl_->sequences.resume(id); }
void Farm::cancel(const SequenceId& id) { impl_->sequences.cancel(id); }
void Farm::retry(const SequenceId& id) { impl_->sequences.retry(id); }
void Farm::set_priority(const SequenceId& id, int priority) { impl_->sequences.set_priority(id, priority); }
void Farm::extend(const SequenceId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                  std::optional<double> target_error) {
  impl_->sequences.extend(id, spp, time_s, target_error);
}
SequenceStatus Farm::sequence(const SequenceId& id) const { return impl_->sequence_view.sequence(id); }
std::vector<SequenceStatus> Farm::sequences(size_t begin, size_t count) const {
  return impl_->sequence_view.sequences(begin, count);
}
size_t Farm::sequence_count() const { return impl_->sequence_view.sequence_count(); }
FramePage Farm::frames(const SequenceId& id, std::optional<int> after, size_t most, uint64_t version) const {
  return impl_->sequence_view.frames(id, after, most, version);
}

std::vector<JobStatus> Farm::jobs(size_t begin, size_t count, bool frames) const {
  return impl_->view.jobs(begin, count, frames);
}
std::vector<JobStatus> Farm::jobs() const { return impl_->view.newest_jobs(); }
size_t Farm::job_count() const { return impl_->view.job_count(); }
JobPage Farm::page(size_t begin, size_t count, uint64_t version, bool waiting, bool frames) const {
  return impl_->view.page(begin, count, version, waiting, frames);
}
JobStatus Farm::job(const JobId& id) const { return impl_->view.job(id); }
JobStatus Farm::wait(const JobId& id, uint64_t version, double timeout_s) const {
  return impl_->view.wait(id, version, timeout_s);
}
std::vector<TileStatus> Farm::tiles(const JobId& id) const { return impl_->view.tiles(id); }
TileMap Farm::tile_map(const JobId& id) const { return impl_->view.tile_map(id); }
std::vector<std::pair<WorkerId, LeaseKey>> Farm::holdings() const { return impl_->view.holdings(); }
std::vector<WorkerStatus> Farm::workers() const { return impl_->view.workers({}, SIZE_MAX).workers; }
WorkerPage Farm::workers(const WorkerId& after, size_t most) const {
  return impl_->view.workers(after, most);
}
TimelinePage Farm::timelines(const WorkerId& after, size_t most, int64_t since) const {
  return impl_->view.timelines(after, most, since);
}
FarmStats Farm::stats() const { return impl_->view.stats(); }

Image Farm::image(const JobId& id) const { return impl_->results.image(id); }
Image Farm::display_image(const JobId& id) const { return impl_->results.display_image(id); }
ChannelImage Farm::aovs(const JobId& id, Image* image, bool for_display) const {
  return impl_->results.aovs(id, image, for_display);
}
ChannelImage Farm::light_groups(const JobId& id, int block) const {
  return impl_->results.light_groups(id, block);
}
Image Farm::error_map(const JobId& id) const { return impl_->results.error_map(id); }
ErrorCurve Farm::curve(const JobId& id) const { return impl_->results.curve(id); }
std::optional<PilotReport> Farm::pilot(const JobId& id) const { return impl_->results.pilot(id); }
std::map<std::string, std::string> Farm::image_metadata(const JobId& id) const {
  return impl_->results.image_metadata(id);
}
Bundle Farm::bundle(const std::string& bundle_digest) const {
  const std::optional<std::string> text = impl_->state.store->bundle_json(bundle_digest);
  if (!text) throw Error(ErrorKind::kFailed, "no job has the bundle " + bundle_digest);
  return bundle_from_json(*text);
}
std::vector<std::string> Farm::open_bundles() const { return impl_->files.open_bundles(); }
std::string Farm::bundle_of(const WorkerId& worker, const LeaseKey& lease) const {
  return impl_->files.bundle_of(worker, lease);
}
void Farm::set_missing_file(const std::string& bundle_digest, const std::string& what, bool in_vain) {
  impl_->files.set_missing(bundle_digest, what, in_vain);
}

std::vector<EndNote> Farm::untold_ends(size_t most) const { return impl_->news.untold(most); }
void Farm::told(const EndNote& note) { impl_->news.told(note); }

// --- workers ---

WorkerId Farm::register_worker(const WorkerRegistration& registration, const std::string& owner) {
  return impl_->workers.register_worker(registration, owner);
}
void Farm::turned_away(const std::string& reason) { impl_->workers.turned_away(reason); }
std::optional<LeaseGrant> Farm::lease(const WorkerId& worker, double wait_s) {
  return impl_->workers.lease(worker, wait_s);
}
std::optional<LeaseGrant> Farm::lease_at_once(const WorkerId& worker) {
  return impl_->workers.lease_at_once(worker);
}
std::vector<LeaseKey> Farm::renew(const WorkerId& worker, const std::vector<LeaseKey>& held) {
  return impl_->workers.renew(worker, held);
}
void Farm::fail(const WorkerId& worker, const LeaseKey& lease, const std::string& reason, FailureKind kind) {
  impl_->workers.fail(worker, lease, reason, kind);
}
void Farm::warn(const WorkerId& worker, const LeaseKey& lease,
                const std::vector<std::string>& missing_light) {
  impl_->workers.warn(worker, lease, missing_light);
}
void Farm::show(const WorkerId& worker, const LeaseKey& lease, Image picture) {
  impl_->workers.show(worker, lease, std::move(picture));
}
void Farm::hand_back(const WorkerId& worker, const LeaseKey& lease) {
  impl_->workers.hand_back(worker, lease);
}
bool Farm::is_proven(const WorkerId& worker) const { return impl_->workers.is_proven(worker); }
void Farm::drain(const WorkerId& worker) { impl_->workers.drain(worker); }

CommitResult Farm::commit(const WorkerId& worker, const LeaseKey& lease, const std::string& partial_bytes,
                          std::string* reason) {
  const CommitResult result = commit_unflushed(worker, lease, partial_bytes, reason);
  if (must_be_durable(result)) flush();
  return result;
}
CommitResult Farm::commit_unflushed(const WorkerId& worker, const LeaseKey& lease,
                                    const std::string& partial_bytes, std::string* reason) {
  return impl_->commits.commit(worker, lease, partial_bytes, reason);
}
void Farm::flush() { impl_->state.store->flush(); }
std::variant<CommitResult, uint64_t> Farm::announce_commit(const WorkerId& worker, const LeaseKey& lease) {
  return impl_->commits.announce(worker, lease);
}

// --- time ---

void Farm::tick() {
  impl_->storage.look_again();
  impl_->repair.repair_damaged();
  {
    const std::lock_guard lock(impl_->state.mutex);
    impl_->leases.release_expired(impl_->state.clock.now());
    impl_->leases.release_overdue(impl_->state.clock.now());
    impl_->checks.drop_lonely(impl_->state.clock.now());
  }
  impl_->checks.take_back_lies();
  impl_->ends.settle_complete();
  impl_->ends.look_at_waiting();
  impl_->budgets.spend();
}

void Farm::stop_waiting() {
  const std::lock_guard lock(impl_->state.mutex);
  impl_->state.stopping = true;
  impl_->state.changed.notify_all();
  impl_->state.work.notify_all();
}

}  // namespace lightmill
