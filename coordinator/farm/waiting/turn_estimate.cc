#include "coordinator/farm/waiting/turn_estimate.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string_view>

#include "coordinator/farm/job_progress.h"

namespace lightmill {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr double kLeastPace = 1e-3;  // of all jobs, processor seconds a second: below, nothing goes on

/// Of a job, or of a sequence as a whole, which share the workers' time as one.
struct Work {
  double left = kUnknown;  // processor seconds
  double pace = 0;         // processor seconds a second, lately
};

Work work_of(const Job& job, double now) {
  const JobRecord& r = job.record;
  if (r.pixel_samples <= 0 || r.cpu_seconds <= 0) return {};
  const double cost = r.cpu_seconds / static_cast<double>(r.pixel_samples);
  const double pace = cost * recent_rate(job.recent, now);
  const double seconds = seconds_left(job, now);
  if (pace > 0 && seconds >= 0) return {seconds * pace, pace};
  return {r.settings.spp < kMaxSpp ? cost * missing_samples(r) : kUnknown, pace};
}

Work work_of(const Sequence& sequence, double now) {
  double seconds = 0, samples = 0, missing = 0;
  for (const auto& [number, frame] : sequence.frames) {
    const JobRecord& r = frame.job->record;
    seconds += r.cpu_seconds;
    samples += static_cast<double>(r.pixel_samples);
    missing += missing_samples(r);
    if (!is_final(r.state) && r.settings.spp >= kMaxSpp) missing = kUnknown;
  }
  if (samples <= 0 || seconds <= 0) return {};
  const double cost = seconds / samples;
  return {cost * missing, cost * recent_rate(sequence.recent, now)};
}

/// What is before the jobs of one submitter and priority, as far as it was passed.
struct Submitter {
  double late_work = 0;                             // of those that will miss their deadlines
  double sharers = 0, served = 0, shared_work = 0;  // of those that share evenly
};
/// The same of one priority.
struct Level {
  std::map<std::string_view, Submitter> submitters;
  double served = 0, work = 0;  // sums over them
};

}  // namespace

std::vector<TurnEstimate> estimate_turns(const Scheduler& scheduler, const std::vector<Turn>& turns,
                                         double now) {
  std::map<const JobShare*, Work> works;
  std::map<int64_t, int> level_sizes;  // by priority
  double pace = 0;
  for (const Turn& turn : turns) {
    const auto [at, is_new] = works.try_emplace(&scheduler.share_of(*turn.job));
    if (!is_new) continue;
    const Sequence* sequence = scheduler.jobs.sequence_of(*turn.job);
    at->second = sequence ? work_of(*sequence, now) : work_of(*turn.job, now);
    pace += at->second.pace;
    ++level_sizes[turn.key.negative_priority];
  }
  std::vector<TurnEstimate> estimates;
  std::set<const JobShare*> passed;
  Level level;
  double higher_work = 0, priority = 0;  // of higher priorities; of this one
  for (const auto& [key, job] : turns) {
    const auto this_priority = static_cast<double>(-key.negative_priority);
    if (estimates.empty() || this_priority != priority) {
      higher_work += level.work;
      level = {};
      priority = this_priority;
    }
    const auto [at, new_submitter] = level.submitters.try_emplace(job->record.submitter);
    Submitter& own = at->second;
    if (new_submitter) level.served += key.submitter_served;
    const double submitters = static_cast<double>(level.submitters.size());
    const bool late = key.late_deadline < kUnknown;

    double before = higher_work + own.late_work;
    before += std::min(level.work, submitters * key.submitter_served - level.served);
    if (!late && key.begun) before += std::min(own.shared_work, own.sharers * key.served - own.served);
    const Work& work = works.at(&scheduler.share_of(*job));
    TurnEstimate estimate;
    estimate.ahead = passed.size() - passed.count(&scheduler.share_of(*job));
    if (pace > kLeastPace && before < kUnknown) {
      estimate.seconds = before / pace;
      // It has all workers then only if nobody shares them.
      const double limit = job->record.settings.time_s;
      double last = kUnknown;
      if (limit > 0) last = std::max(0.0, limit - wall_seconds(*job, now));
      if (level_sizes[key.negative_priority] == 1) last = std::min(last, work.left / pace);
      if (last < kUnknown) estimate.end_seconds = estimate.seconds + last;
    }
    estimates.push_back(estimate);

    if (!passed.insert(&scheduler.share_of(*job)).second) continue;
    level.work += work.left;
    if (late) {
      own.late_work += work.left;
    } else if (key.begun) {
      ++own.sharers;
      own.served += key.served;
      own.shared_work += work.left;
    }
  }
  return estimates;
}

}  // namespace lightmill
