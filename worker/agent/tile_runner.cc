#include "worker/agent/tile_runner.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <map>
#include <thread>
#include <vector>

#include "common/base/error.h"
#include "common/base/log.h"
#include "common/farm/pilot_result.h"
#include "common/sandbox/sandbox.h"
#include "worker/agent/backoff.h"
#include "worker/agent/blob_giver.h"
#include "worker/agent/float_mode.h"
#include "worker/agent/processor_time.h"

namespace lightmill::agent {
namespace {

const char* outcome_name(CommitResult outcome) {
  switch (outcome) {
    case CommitResult::kAccepted:
      return "accepted";
    case CommitResult::kAlreadyCommitted:
      return "already committed";
    case CommitResult::kStale:
      return "stale";
    case CommitResult::kCorrupt:
      return "corrupt";
    case CommitResult::kUnknownJob:
      return "unknown job";
  }
  return "?";
}

std::string describe(const LeaseKey& key) {
  return key.job.value + " tile " + std::to_string(key.tile.value) + " attempt " +
         std::to_string(key.attempt);
}

LogContext about(const LeaseKey& key) { return {key.job.value, key.tile.value, key.attempt, ""}; }

/// So often in a row is not an accident on the way any more.
constexpr int kMostDamaged = 3;
constexpr int kMostRefusals = 2;
/// Between looks at what the coordinator has lost.
constexpr double kGiveSeconds = 1;

/// How long it takes to get a tile ready: what the quickest of the newest calls took, as the others may have
/// waited for work, twice over, and what opening the last scene took.
class LeaseLead {
 public:
  void called(double seconds) { calls_[next_++ % calls_.size()] = seconds; }
  void opened(double seconds) { open_ = seconds; }
  double seconds() const {
    return std::clamp(2 * *std::min_element(calls_.begin(), calls_.end()) + open_, kLeast, kMost);
  }

 private:
  static constexpr double kLeast = 0.05, kMost = 2;
  std::array<double, 4> calls_{};
  size_t next_ = 0;
  double open_ = 0;
};

/// A render thread's workspaces: of the renderers that it used last, most recent first.
class Workspaces {
 public:
  Workspace& of(const std::shared_ptr<const PacketRenderer>& renderer) {
    auto found =
        std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.renderer == renderer; });
    if (found == kept_.end()) {
      if (kept_.size() == kMost) kept_.pop_back();
      found = kept_.insert(kept_.begin(), Kept{renderer, renderer->make_workspace()});
    }
    std::rotate(kept_.begin(), found, found + 1);
    return *kept_.front().workspace;
  }

 private:
  static constexpr size_t kMost = 2;  // two leases of two jobs take turns
  struct Kept {
    std::shared_ptr<const PacketRenderer> renderer;  // before the workspace, which may refer to it
    std::unique_ptr<Workspace> workspace;
  };
  std::vector<Kept> kept_;
};

}  // namespace

TileRunner::TileRunner(FarmLink& link, RenderSource& source, RunnerOptions options)
    : link_(link), source_(source), options_(std::move(options)), queue_(options_.threads) {}

void TileRunner::run() {
  std::vector<std::jthread> threads;  // joined whatever happens
  try {
    for (int i = 0; i < options_.threads; ++i) threads.emplace_back([this] { render_loop(); });
    threads.emplace_back([this] { commit_loop(); });
    threads.emplace_back([this] { pilot_loop(); });
    threads.emplace_back([this] { renew_loop(); });
    threads.emplace_back([this] { give_loop(); });
  } catch (...) {  // the system has no more: those that there are must not wait for work
    stop();
    throw;
  }
  set_float_mode();
  lease_loop();
  if (!is_stopping()) finish_held();
  stop();
  threads.clear();
  const std::lock_guard lock(refusal_mutex_);
  if (refusal_) std::rethrow_exception(refusal_);
}

void TileRunner::drain() {
  draining_ = true;
  queue_.stop_growing();
  const std::lock_guard lock(mutex_);
  woken_.notify_all();
}

void TileRunner::stop() {
  stopping_ = true;
  queue_.close();
  link_.cancel();
  const std::lock_guard lock(mutex_);
  woken_.notify_all();
}

/// False if it is time to stop; wakes early for that, and once `wanted` turns false on a drain.
bool TileRunner::sleep(double seconds, const std::function<bool()>& wanted) {
  std::unique_lock lock(mutex_);
  woken_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return is_stopping() || !wanted(); });
  return !is_stopping();
}

bool TileRunner::register_again(uint64_t seen) {
  const std::lock_guard lock(register_mutex_);
  if (generation_ != seen) return true;  // another thread did
  for (int refusals = 1;; ++refusals) {
    try {
      link_.register_worker(options_.registration);
      ++generation_;
      return true;
    } catch (const Error& refused) {
      if (refusals < kMostRefusals) {  // a damaged call is refused like a wrong one
        options_.log(std::string(refused.what()) + "; asking once more");
        continue;
      }
      {
        const std::lock_guard refusal_lock(refusal_mutex_);
        refusal_ = std::current_exception();
      }
      stop();
      return false;
    }
  }
}

/// Calls `call` until it went through, while `wanted()` and not stopping; registers (again) when told to.
/// False if it gave up. What `call` throws as Error passes through, Damaged after the third time in a row.
template <class F>
bool TileRunner::retry(const std::function<bool()>& wanted, F call) {
  Backoff backoff;
  bool complained = false;
  int damaged = 0;
  while (!is_stopping() && wanted()) {
    const uint64_t seen = generation_;
    try {
      if (seen == 0) throw NotRegistered("not yet");
      call();
      return true;
    } catch (const NotRegistered&) {
      try {
        if (!register_again(seen)) return false;
        if (seen != 0) options_.log("registered again");
        continue;
      } catch (const LinkDown& down) {
        if (!complained && !is_stopping()) options_.log(std::string(down.what()) + "; trying again");
      }
    } catch (const LinkDown& down) {
      if (!complained && !is_stopping()) options_.log(std::string(down.what()) + "; trying again");
      damaged = 0;
    } catch (const Damaged& damage) {
      if (++damaged == kMostDamaged) throw;
      options_.log(std::string(damage.what()) + "; trying again");
    }
    complained = true;
    sleep(backoff.next(), wanted);
  }
  return false;
}

void TileRunner::lease_loop() {
  Backoff failures, idle;
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  LeaseLead lead;
  queue_.set_lead(lead.seconds());
  Clock::time_point busy = Clock::now();
  const auto idle_too_long = [&] {
    if (!queue_.held().empty()) busy = Clock::now();
    return options_.idle_timeout_seconds > 0 && since(busy) > options_.idle_timeout_seconds;
  };
  const std::function<bool()> wanted = [&] { return !draining_ && !idle_too_long(); };
  while (queue_.wait_for_room()) {
    if (idle_too_long()) {
      options_.log("nothing to do for long enough: leaving");
      drain();
      continue;
    }
    std::optional<LeaseGrant> lease;
    const auto asked = Clock::now();
    try {
      if (!retry(wanted, [&] { lease = link_.lease(options_.lease_wait_seconds); })) continue;
    } catch (const Error& error) {  // a benched worker, a coordinator that is full
      options_.log(error.what());
      sleep(failures.next(), wanted);
      continue;
    }
    if (!lease) {
      // A coordinator with too many that wait answers at once: the wait is then ours.
      if (since(asked) < options_.lease_wait_seconds / 4) sleep(idle.next(), wanted);
      continue;
    }
    lead.called(since(asked));
    const auto granted = Clock::now();
    idle.reset();
    const LogScope scope(about(key_of(*lease)));
    queue_.hold(key_of(*lease));
    lease_seconds_ = lease->lease_seconds;
    try {
      open_lease(*lease);
      lead.opened(since(granted));
      queue_.set_lead(lead.seconds());
      failures.reset();
    } catch (const MissingBlob& missing) {
      options_.log(describe(key_of(*lease)) + ": handed back: " + missing.what());
      hand_back(key_of(*lease), HandBack::kMissingBlob);
      queue_.release(key_of(*lease));
      sleep(failures.next(), wanted);
    } catch (const std::exception& error) {
      give_up(key_of(*lease), failure_of(error));
      queue_.release(key_of(*lease));
      sleep(failures.next(), wanted);  // do not ask for the same scene in a tight loop
    }
  }
}

void TileRunner::open_lease(const LeaseGrant& lease) {
  std::shared_ptr<const PacketRenderer> renderer;
  const auto wanted = [&] { return queue_.is_held(key_of(lease)); };
  const bool pilot = is_pilot(lease.tile);
  bool shown = false;
  const LookWanted look{[&] { return wanted() && !is_stopping(); },
                        [&](const Image& picture) {
                          show(lease, picture);
                          shown = true;
                        }};
  if (!retry(wanted,
             [&] { renderer = source_.open(lease.bundle_digest, lease.settings, pilot ? &look : nullptr); }))
    return;
  if (pilot) {
    queue_.start_pilot({lease, std::move(renderer), shown});
    return;
  }
  const std::vector<std::string> missing = renderer->missing_light();
  const std::pair<JobId, uint64_t> told{lease.job, generation_};
  if (!missing.empty() && warned_ != told) {
    if (!retry(wanted, [&] { link_.warn(key_of(lease), missing); })) return;
    warned_ = told;
  }
  queue_.start(std::make_shared<ActiveLease>(lease, std::move(renderer)));
}

void TileRunner::render_loop() {
  set_float_mode();
  Workspaces workspaces;
  while (const auto work = queue_.take()) {
    TileFailure failure;
    try {
      ActiveLease& lease = *work->lease;
      lease.renderer->render_packet(work->packet, workspaces.of(lease.renderer), lease.builder);
    } catch (const std::exception& thrown) {
      failure = failure_of(thrown);
    }
    queue_.finish(*work, failure);
  }
}

void TileRunner::commit_loop() {
  while (auto finished = queue_.take_finished()) {
    const LeaseKey key = key_of(finished->lease->lease);
    const LogScope scope(about(key));
    TileFailure failure;
    try {
      commit_one(*finished);
    } catch (const std::exception& error) {
      failure = failure_of(error);
    }
    finished->lease.reset();  // if memory is what it lacks, the farm is to hear of it
    if (!failure.text.empty()) give_up(key, failure);
    queue_.release(key);
  }
}

void TileRunner::commit_one(const LeaseQueue::Finished& finished) {
  const LeaseKey key = key_of(finished.lease->lease);
  if (!finished.failure.text.empty()) return report_failure(key, finished.failure);
  RenderCounters counters;
  double cpu_seconds = 0;
  std::string bytes;
  {
    const Partial partial = finished.lease->builder.take();  // its layers need not wait for the answer
    counters = partial.counters;
    cpu_seconds = partial.cpu_seconds;
    bytes = encode_partial(partial);
  }
  if (!hand_in(key, bytes)) return;
  ++tiles_committed_;
  options_.accepted(counters, cpu_seconds);
}

void TileRunner::report_failure(const LeaseKey& key, const TileFailure& failure) {
  options_.log(describe(key) + ": " + failure.text);
  retry([&] { return queue_.is_held(key); }, [&] { link_.fail(key, failure.text, failure.kind); });
}

void TileRunner::give_up(const LeaseKey& key, const TileFailure& failure) {
  try {
    report_failure(key, failure);
  } catch (const std::exception& refused) {  // then its lease runs out
    options_.log(describe(key) + ": " + refused.what());
  }
}

void TileRunner::hand_back(const LeaseKey& key, HandBack why) {
  try {
    link_.hand_back(key, why);
  } catch (const std::exception& error) {  // then its lease runs out
    options_.log(describe(key) + ": " + error.what());
  }
}

bool TileRunner::hand_in(const LeaseKey& key, const std::string& bytes) {
  CommitAnswer answer;
  try {
    if (!retry([&] { return queue_.is_held(key); }, [&] { answer = link_.commit(key, bytes); })) return false;
  } catch (const Error& error) {  // give it back at once: another worker, or another try, may do better
    report_failure(key, {std::string("the partial can't be handed in: ") + error.what()});
    return false;
  }
  const std::string line = describe(key) + ": " + outcome_name(answer.outcome);
  if (answer.outcome == CommitResult::kAccepted) {
    options_.debug(line);
  } else {
    options_.log(line + (answer.message.empty() ? "" : ": " + answer.message));
  }
  return answer.outcome == CommitResult::kAccepted;
}

void TileRunner::pilot_loop() {
  set_float_mode();
  while (const auto pilot = queue_.take_pilot()) {
    const LeaseKey key = key_of(pilot->lease);
    const LogScope scope(about(key));
    try {
      run_pilot(*pilot);
    } catch (const std::exception& error) {
      options_.log(describe(key) + ": " + error.what());
    }
    queue_.release(key);
  }
}

void TileRunner::run_pilot(const PilotLease& pilot) {
  const LeaseKey key = key_of(pilot.lease);
  const auto go_on = [&] { return queue_.is_held(key) && !draining_ && !is_stopping(); };
  PilotResult result;
  const ProcessorTime time(options_.threads);
  if (!pilot.shown) take_first_look(pilot, go_on);
  try {
    result.report = pilot.renderer->run_pilot(options_.threads, go_on);
  } catch (const std::exception& error) {
    if (go_on()) {
      report_failure(key, failure_of(error));
    } else if (queue_.is_held(key) && !is_stopping()) {
      hand_back(key, HandBack::kNoTime);
    }
    return;
  }
  result.cpu_seconds = time.seconds();
  hand_in(key, encode_pilot(result));
}

/// Nothing depends on it: what fails is left out.
void TileRunner::take_first_look(const PilotLease& pilot, const std::function<bool()>& go_on) {
  try {
    const Image picture = pilot.renderer->first_look(options_.threads, go_on);
    if (!picture.data.empty()) show(pilot.lease, picture);
  } catch (const std::exception& error) {
    options_.debug(describe(key_of(pilot.lease)) + ": no first look: " + error.what());
  }
}

void TileRunner::show(const LeaseGrant& lease, const Image& picture) {
  try {
    link_.show(key_of(lease), picture);
    options_.debug(describe(key_of(lease)) + ": first look shown");
  } catch (const std::exception& error) {
    options_.debug(describe(key_of(lease)) + ": the first look is not shown: " + error.what());
  }
}

void TileRunner::renew_loop() {
  while (sleep(lease_seconds_ / 3)) {
    const std::vector<LeaseKey> held = queue_.held();
    if (held.empty() || generation_ == 0) continue;
    try {
      std::vector<LeaseKey> lost;
      const double give_up = lease_seconds_;  // by then the next round is due, with the leases of that moment
      const auto start = std::chrono::steady_clock::now();
      const auto wanted = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < give_up;
      };
      if (!retry(wanted, [&] { lost = link_.renew(held); })) continue;
      for (const LeaseKey& key : lost) {
        const LogScope scope(about(key));
        options_.log(describe(key) + ": lease lost");
      }
      queue_.lose(lost);
    } catch (const std::exception& error) {
      options_.log(error.what());
    }
  }
}

void TileRunner::give_loop() {
  BlobGiver giver(link_, source_, options_.log);
  const auto start = std::chrono::steady_clock::now();
  while (sleep(kGiveSeconds)) {
    giver.give(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}

void TileRunner::finish_held() {
  try {
    link_.drain();
  } catch (const std::exception& error) {  // it learns of it when the leases end
    options_.log(error.what());
  }
  const double timeout = std::clamp(options_.drain_timeout_seconds, 0.0, 1e6);
  if (queue_.wait_until_empty(timeout)) return;
  options_.log("drain timeout: the tiles still held are handed back");
  for (const LeaseKey& key : queue_.held()) hand_back(key, HandBack::kNoTime);
}

}  // namespace lightmill::agent
