#include "coordinator/farm/worker_table.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace lightmill {
namespace {

constexpr double kLostAfterLeases = 3;  // lease times without a word
// A worker with as much blame is benched. A good tile takes less away than a refused partial brings: who
// sends rubbish every other time does not get away with it, who fails now and then does.
constexpr double kBenchingBlame = 8, kFailureBlame = 1, kRefusalBlame = 8 / 3.0, kMadeGood = 1;
constexpr double kHandBackBlame = 0.5;
// A worker leases the next tile before it has rendered the last one. The first few are few for any number of
// threads: until it has delivered one, nobody knows that it renders at all.
constexpr int64_t kFewLeases = 4, kThreadsPerLease = 16, kMostLeases = 64;
constexpr double kFirstBenchSeconds = 30;
constexpr double kLongestBenchSeconds = 600;
constexpr double kSmoothing = 0.3;  // weight of the newest tile in a worker's speed
// Of elapsed and rendered seconds with each further tile. A worker that was stopped for long is not taken for
// a slow one for ever.
constexpr double kKeptOfElapsed = 0.7, kMostSlowdown = 8;

WorkerStatus status_of(const Worker& worker, const char* state, double now) {
  return {worker.id,
          worker.registration,
          state,
          worker.tiles_committed,
          worker.samples_per_second,
          worker.polling > 0 ? 0 : std::max(0.0, now - worker.last_seen),
          worker.partials_refused};
}

bool is_forgotten(const RefusedWorker& refused, double now) {
  return now - refused.at > WorkerTable::kRefusedKeptSeconds;
}

}  // namespace

std::string printable(std::string text) {
  constexpr size_t kMost = 200;
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

/// The one that was silent longest, of those that may go.
bool WorkerTable::make_room(const std::string& owner, double now) {
  if (std::erase_if(workers_, [&](const auto& item) { return is_lost(item.second, now); }) > 0) return true;
  std::map<std::string, size_t> owned;
  for (const auto& [id, worker] : workers_) ++owned[worker.owner];
  const auto rank = [&](const Worker& worker) {  // 0: it stays
    if (worker.leases > 0 || worker.polling > 0 || worker.tiles_committed > 0) return 0;
    if (!worker.asked) return 2;
    return owned[worker.owner] > owned[owner] + 1 ? 1 : 0;
  };
  auto first = workers_.end();
  int best = 0;
  for (auto it = workers_.begin(); it != workers_.end(); ++it) {
    const int own = rank(it->second);
    if (own == 0 || own < best) continue;
    if (own > best || it->second.last_seen < first->second.last_seen) first = it;
    best = own;
  }
  if (first == workers_.end()) return false;
  workers_.erase(first);
  return true;
}

void WorkerTable::add(const WorkerId& id, const WorkerRegistration& registration, const std::string& owner,
                      double now) {
  if (workers_.size() >= max_workers_ && !make_room(owner, now)) {
    throw Error(
        ErrorKind::kUnreachable,
        "the coordinator has its limit of " + std::to_string(max_workers_) +
            " workers; stop some, start the coordinator with a larger --max-workers, or a second one");
  }
  Worker worker;
  worker.id = id;
  worker.registration = registration;
  worker.owner = owner;
  worker.last_seen = now;
  worker.activity = WorkerActivity(now);
  workers_[id] = worker;
}

void WorkerTable::add_refused(const WorkerId& id, const WorkerRegistration& registration,
                              const std::string& reason, double now) {
  std::erase_if(refused_, [&](const RefusedWorker& refused) {
    return (refused.registration.host == registration.host && refused.reason == reason) ||
           is_forgotten(refused, now);
  });
  refused_.push_back({id, registration, reason, now});
  if (refused_.size() > kMaxRefused) refused_.pop_front();
}

std::string WorkerTable::refusals(double now) const {
  std::set<std::string> hosts;
  for (const RefusedWorker& refused : refused_) {
    if (!is_forgotten(refused, now)) hosts.insert(refused.registration.host);
  }
  if (hosts.empty()) return "";
  const RefusedWorker& last = refused_.back();
  const std::string host = last.registration.host.empty()
                               ? std::string("an unknown host")
                               : "host \"" + printable(last.registration.host) + "\"";
  const std::string who =
      hosts.size() == 1 ? "that of " + host + " was refused"
                        : "those of " + std::to_string(hosts.size()) + " hosts were refused, last of " + host;
  return who + ": " + last.reason;
}

Worker* WorkerTable::find(const WorkerId& id) {
  const auto found = workers_.find(id);
  return found == workers_.end() ? nullptr : &found->second;
}
const Worker* WorkerTable::find(const WorkerId& id) const { return const_cast<WorkerTable*>(this)->find(id); }

void WorkerTable::seen(const WorkerId& id, double now) {
  if (Worker* worker = find(id)) worker->last_seen = now;
}

bool WorkerTable::is_lost(const Worker& worker, double now) const {
  return worker.polling == 0 && now - worker.last_seen > kLostAfterLeases * lease_seconds_;
}

bool WorkerTable::was_heard(const Worker& worker, double now) const {
  return worker.polling > 0 || now - worker.last_seen < lease_seconds_;
}

bool WorkerTable::may_work(const Worker& worker, double now) const {
  return !worker.draining && now >= worker.benched_until && !is_lost(worker, now);
}

int64_t WorkerTable::most_leases(const Worker& worker) {
  if (!is_proven(worker)) return kFewLeases;
  return std::min(kFewLeases + worker.registration.threads / kThreadsPerLease, kMostLeases);
}

void WorkerTable::leased(const WorkerId& id, const JobId& job, double now) {
  Worker* worker = find(id);
  if (!worker) return;
  ++worker->leases;
  worker->activity.begin(job, now);
}

void WorkerTable::released(const WorkerId& id, const JobId& job, bool delivered, double now) {
  Worker* worker = find(id);
  if (!worker) return;
  --worker->leases;
  worker->activity.end(job, delivered, now);
}

void WorkerTable::committed(const WorkerId& id, double samples, double seconds, double since, double now) {
  Worker* worker = find(id);
  if (!worker) return;
  const double begun = std::max(since, worker->last_commit);
  worker->last_commit = now;
  ++worker->tiles_committed;
  worker->blame = std::max(0.0, worker->blame - kMadeGood);
  if (worker->blame == 0) worker->times_benched = 0;
  if (!(seconds > 0) || !(samples > 0)) return;
  worker->elapsed_seconds = kKeptOfElapsed * worker->elapsed_seconds + std::max(0.0, now - begun);
  worker->rendered_seconds = kKeptOfElapsed * worker->rendered_seconds + seconds;
  const double rate = samples / seconds;
  worker->samples_per_second =
      worker->samples_per_second > 0 ? std::lerp(worker->samples_per_second, rate, kSmoothing) : rate;
}

double WorkerTable::slowdown(const Worker& worker) {
  if (!(worker.rendered_seconds > 0)) return 1;
  return std::clamp(worker.elapsed_seconds / worker.rendered_seconds, 1.0, kMostSlowdown);
}

void WorkerTable::failed(const WorkerId& id, double now) { blame(find(id), kFailureBlame, now); }

void WorkerTable::undelivered(const WorkerId& id, double now) {
  Worker* worker = find(id);
  blame(worker, worker && is_proven(*worker) ? kFailureBlame : kRefusalBlame, now);
}

void WorkerTable::handed_back(const WorkerId& id, double now) { blame(find(id), kHandBackBlame, now); }

void WorkerTable::refused(const WorkerId& id, double now) {
  Worker* worker = find(id);
  if (worker) ++worker->partials_refused;
  blame(worker, kRefusalBlame, now);
}

void WorkerTable::convict(const WorkerId& id, double now) {
  Worker* worker = find(id);
  if (!worker) return;
  ++worker->partials_refused;
  worker->convicted = true;
  worker->blame = kBenchingBlame / 2;
  worker->benched_until = now + kLongestBenchSeconds;
}

void WorkerTable::blame(Worker* worker, double weight, double now) {
  if (!worker) return;
  worker->blame += weight;
  if (worker->blame < kBenchingBlame) return;
  worker->blame = kBenchingBlame / 2;  // it has to prove itself before it counts as sound again
  worker->benched_until =
      now + std::min(kLongestBenchSeconds, std::ldexp(kFirstBenchSeconds, worker->times_benched));
  worker->times_benched = std::min(worker->times_benched + 1, 10);
}

TimelinePage WorkerTable::timelines(const WorkerId& after, size_t most, int64_t since, double now) {
  TimelinePage result;
  result.cell = WorkerActivity::cell_of(now);
  for (auto it = workers_.upper_bound(after); it != workers_.end(); ++it) {
    if (result.workers.size() == most) {
      result.last = result.workers.back().id;
      break;
    }
    WorkerActivity& activity = it->second.activity;
    result.workers.push_back(
        {it->first, activity.present_seconds(now), activity.busy_seconds(now), activity.spans(now, since)});
  }
  return result;
}

WorkerPage WorkerTable::page(const WorkerId& after, size_t most, double now) const {
  WorkerPage result;
  for (auto it = workers_.upper_bound(after); it != workers_.end(); ++it) {
    if (result.workers.size() == most) {
      result.last = result.workers.back().id;
      break;
    }
    const Worker& worker = it->second;
    const char* state = is_lost(worker, now)         ? "lost"
                        : worker.draining            ? "draining"
                        : now < worker.benched_until ? "benched"
                        : worker.leases > 0          ? "rendering"
                                                     : "idle";
    result.workers.push_back(status_of(worker, state, now));
  }
  result.total = workers_.size();
  for (const RefusedWorker& refused : refused_) {
    if (is_forgotten(refused, now)) continue;
    ++result.total;
    if (!result.last.value.empty()) continue;
    result.workers.push_back(
        {refused.id, refused.registration, "refused", 0, 0, std::max(0.0, now - refused.at), 0});
  }
  return result;
}

}  // namespace lightmill
