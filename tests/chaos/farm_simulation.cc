#include "tests/chaos/farm_simulation.h"

#include <stdexcept>

#include "coordinator/merge/store_check.h"

namespace lightmill::testing {
namespace {

constexpr double kStep = 0.25;  // as often as the coordinator ticks
constexpr double kLongestRun = 3600;
constexpr double kChaosSeconds = 60;  // after that nothing new goes wrong
constexpr double kRetryAfter = 2;     // a worker without an answer sends its commit again
constexpr int kWorkers = 4;

LeaseKey key_of(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }

}  // namespace

FarmSimulation::FarmSimulation(uint64_t seed, const JobRequest& request, int spot_check)
    : seed_(seed), random_(seed), request_(request), options_(fake_options()), workers_(kWorkers) {
  options_.checkpoint_bytes = 60e3;
  options_.spot_check = spot_check;
  options_.spot_check_seed = seed + 1;
  options_.max_attempts = 1000;  // what is damaged on purpose must not fail the job
  farm_ = std::make_unique<Farm>(std::make_unique<WatchedStore>(store_,
                                                                [this](int) {
                                                                  if (now_ < storage_broken_until_)
                                                                    throw StoreError("disk full");
                                                                }),
                                 clock_, options_);
  job_ = farm_->submit(request_);
  for (Worker& worker : workers_) worker.speed = draw(0.3, 3);
  workers_.back().speed = 100;  // one is always ready to take over
}
FarmSimulation::~FarmSimulation() = default;

void FarmSimulation::fail(const std::string& what) const {
  throw std::runtime_error("seed " + std::to_string(seed_) + " at " + std::to_string(now_) + " s: " + what);
}

void FarmSimulation::crash_coordinator() {
  ++counts_.crashes;
  counts_.races += static_cast<int>(farm_->stats().races);
  counts_.checks += farm_->stats().checks;
  if (farm_->stats().liars > 0) fail("an honest worker was convicted");
  farm_.reset();  // what was not in the store is gone
  storage_broken_until_ = -1;
  farm_ = std::make_unique<Farm>(std::make_unique<WatchedStore>(store_,
                                                                [this](int) {
                                                                  if (now_ < storage_broken_until_)
                                                                    throw StoreError("disk full");
                                                                }),
                                 clock_, options_);
  dead_since_.clear();  // no lease outlives the coordinator
}

void FarmSimulation::bring_chaos() {
  if (chance(0.02)) crash_coordinator();
  if (chance(0.02)) {
    ++counts_.storage_faults;
    storage_broken_until_ = now_ + draw(0.2, 8);
    quiet_until_ =
        std::max(quiet_until_, storage_broken_until_ + 5);  // a probe every four seconds finds it mended
  }
  if (chance(0.01)) {
    ++counts_.clock_jumps;
    const double jump = chance(0.5) ? draw(1, 1000) : -draw(0.1, 20);
    clock_.advance(jump);
    if (jump < 0) quiet_until_ = std::max(quiet_until_, now_) - jump + kStep;
  }
  for (size_t i = 0; i + 1 < workers_.size(); ++i) {
    Worker& worker = workers_[i];
    if (worker.alive && chance(0.02)) {
      ++counts_.deaths;
      worker.alive = false;
      if (!worker.id.value.empty()) dead_since_[worker.id] = now_;
      worker.id = {};
      worker.held.clear();
    } else if (!worker.alive && chance(0.1)) {
      worker.alive = true;
    }
    if (worker.alive && chance(0.02)) {
      ++counts_.pauses;
      worker.stopped_until = now_ + draw(0.5, 30);
    }
  }
}

void FarmSimulation::lease(Worker& worker) {
  if (chance(0.05)) return;  // the call was lost
  const std::optional<LeaseGrant> grant = farm_->lease(worker.id);
  if (!grant || chance(0.05)) return;  // or its answer: then nobody renders it, and it runs out
  if (store_.tiles(job_).at(static_cast<size_t>(grant->tile_id.value)).state == TileState::kCommitted)
    checks_.insert(key_of(*grant));
  if (grant->attempt > 1) ++counts_.re_leased_after_death;
  worker.held[key_of(*grant)] = {*grant, now_ + draw(0.1, 4) / worker.speed, -1};
  worker.next_renewal = std::min(worker.next_renewal, now_ + options_.lease_seconds / 3);
}

void FarmSimulation::send_commit(Worker& worker, const LeaseKey& key) {
  Worker::Held& held = worker.held.at(key);
  held.sent_at = now_;
  const auto index = static_cast<size_t>(&worker - workers_.data());
  std::string bytes = fake_bytes(held.grant);
  const bool calm = now_ > kChaosSeconds;
  int copies = 1;
  if (!calm && chance(0.1)) {
    ++counts_.lost;
    copies = 0;
  } else if (!calm && chance(0.2)) {
    ++counts_.repeated;
    copies = static_cast<int>(draw(2, 4));
  }
  for (int copy = 0; copy < copies; ++copy) {
    double delay = calm ? 0 : draw(0, 0.5);
    if (!calm && chance(0.2)) {  // so late that the lease, the worker or the job may be gone
      ++counts_.late;
      delay = draw(1, 40);
    }
    std::string sent = bytes;
    if (!calm && chance(0.05)) {
      ++counts_.damaged;
      sent[static_cast<size_t>(draw(0, static_cast<double>(sent.size())))] ^=
          static_cast<char>(1 << static_cast<int>(draw(0, 8)));
      if (chance(0.3)) sent.resize(sent.size() / 2);
    }
    const bool answered = calm || !chance(0.1);
    messages_.push_back({now_ + delay, [this, index, id = worker.id, key, sent, answered] {
                           deliver_commit(index, id, key, sent, answered);
                         }});
  }
}

void FarmSimulation::deliver_commit(size_t index, const WorkerId& id, const LeaseKey& key,
                                    const std::string& bytes, bool answered) {
  CommitResult result = CommitResult::kStale;
  try {
    result = farm_->commit(id, key, bytes);
  } catch (const StoreError&) {
    return;  // no answer; the worker will try again
  }
  if (checks_.contains(key)) {
    if (answered && workers_[index].id == id) workers_[index].held.erase(key);
    return;
  }
  if (result == CommitResult::kAccepted) {
    if (!acknowledged_.insert(key).second) fail("one attempt was accepted twice");
  } else if (result == CommitResult::kAlreadyCommitted && !acknowledged_.contains(key)) {
    acknowledged_.insert(key);  // the disk failed between the write and the answer
  }
  if (answered && workers_[index].id == id) workers_[index].held.erase(key);
}

void FarmSimulation::act(Worker& worker) {
  try {
    if (worker.id.value.empty()) {
      worker.id = farm_->register_worker(registration());
      worker.next_renewal = now_;
    }
    if (!worker.held.empty() && now_ >= worker.next_renewal) {
      std::vector<LeaseKey> held;
      for (const auto& [key, lease] : worker.held) held.push_back(key);
      for (const LeaseKey& lost : farm_->renew(worker.id, held)) worker.held.erase(lost);
      worker.next_renewal = now_ + options_.lease_seconds / 3;
    }
    if (worker.held.size() < 2) lease(worker);
  } catch (const UnknownWorker&) {
    worker.id = {};  // what it holds it still tries to hand in
  } catch (const StoreError&) {
    return;
  }
  std::vector<LeaseKey> finished;
  for (const auto& [key, held] : worker.held) {
    if (now_ >= held.done_at && (held.sent_at < 0 || now_ >= held.sent_at + kRetryAfter))
      finished.push_back(key);
  }
  for (const LeaseKey& key : finished) send_commit(worker, key);
}

void FarmSimulation::check_acknowledged() {
  const std::vector<TileRecord> tiles = store_.tiles(job_);
  for (const LeaseKey& key : acknowledged_) {
    const TileRecord& tile = tiles.at(static_cast<size_t>(key.tile.value));
    if (tile.state != TileState::kCommitted || lease_tokens(tile).at(0).attempt != key.attempt) {
      fail("tile " + std::to_string(key.tile.value) + " was acknowledged under attempt " +
           std::to_string(key.attempt) + ", and the ledger does not have it");
    }
  }
}

/// Nobody waits for the dead longer than their leases last, and a second.
void FarmSimulation::check_dead_leases() {
  if (now_ < quiet_until_ || dead_since_.empty()) return;
  for (const TileStatus& tile : farm_->tiles(job_)) {
    const auto dead = tile.state == "leased" ? dead_since_.find(tile.worker) : dead_since_.end();
    if (dead == dead_since_.end()) continue;
    const double waited = now_ - std::max(dead->second, quiet_until_);
    counts_.longest_wait_for_dead = std::max(counts_.longest_wait_for_dead, waited);
    if (waited > options_.lease_seconds + 1) {
      fail("tile " + std::to_string(tile.id.value) + " is still leased to " + tile.worker.value +
           ", dead for " + std::to_string(waited) + " s");
    }
  }
}

void FarmSimulation::step() {
  now_ += kStep;
  clock_.advance(kStep);
  if (now_ < kChaosSeconds) bring_chaos();
  std::vector<Message> due;
  std::erase_if(messages_, [&](const Message& message) {
    if (message.at > now_) return false;
    due.push_back(message);
    return true;
  });
  std::shuffle(due.begin(), due.end(), random_);
  for (const Message& message : due) message.deliver();
  try {
    farm_->tick();
  } catch (const StoreError&) {
    // as lightmill-coordinator does: the next tick tries again
  }
  for (Worker& worker : workers_) {
    if (worker.alive && now_ >= worker.stopped_until) act(worker);
  }
  check_acknowledged();
  check_dead_leases();
}

void FarmSimulation::check_end() {
  const JobStatus status = farm_->job(job_);
  if (status.packets_done != status.packets_total) fail("packets are missing");
  if (!same_pixels(farm_->image(job_), fake_image(request_.settings))) fail("the image differs");
  for (const std::string& problem : check_store(store_)) fail(problem);
}

ChaosCounts FarmSimulation::run() {
  while (farm_->job(job_).state != JobState::kDone) {
    step();
    if (is_final(farm_->job(job_).state) && farm_->job(job_).state != JobState::kDone)
      fail("the job ended: " + farm_->job(job_).message);
    if (now_ > kLongestRun) fail("still not done: " + farm_->job(job_).message);
  }
  check_acknowledged();
  check_end();
  crash_coordinator();
  for (const Message& message : messages_) message.deliver();  // what is late comes after the end, too
  check_acknowledged();
  check_end();
  counts_.seconds = now_;
  return counts_;
}

}  // namespace lightmill::testing
