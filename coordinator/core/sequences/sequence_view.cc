#include "coordinator/core/sequences/sequence_view.h"

#include <algorithm>
#include <string>

#include "coordinator/farm/job_progress.h"

namespace lightmill {
namespace {

constexpr size_t kMostCurvesOfLook = 200;  // that are read under one lock

int64_t count(const SequenceStatus& s, JobState state) { return s.frames[static_cast<int>(state)]; }

/// That of the frames: the first of these that one has.
JobState state_of(const SequenceStatus& s) {
  for (const JobState state :
       {JobState::kRunning, JobState::kQueued, JobState::kPaused, JobState::kFailed, JobState::kCancelled}) {
    if (count(s, state) > 0) return state;
  }
  return s.frame_count > 0 ? JobState::kDone : JobState::kQueued;
}

}  // namespace

SequenceStatus SequenceView::status(const Sequence& sequence, double now) const {
  SequenceStatus s;
  s.id = sequence.record.id;
  s.request = sequence.record.request;
  s.version = sequence.version;
  s.frame_count = static_cast<int64_t>(sequence.frames.size());
  const Job* failed = nullptr;
  double errors = 0;
  int64_t estimates = 0;
  for (const auto& [number, frame] : sequence.frames) {
    const Job& job = *frame.job;
    const JobRecord& r = job.record;
    ++s.frames[static_cast<int>(r.state)];
    s.packets_done += r.packets_done;
    s.packets_total += FarmView::packets_total(r);
    s.wall_seconds += wall_seconds(job, now);
    s.cpu_seconds += r.cpu_seconds;
    s.workers += job.tiles.workers();
    if (r.state == JobState::kFailed && !failed) failed = &job;
    if (job.last_estimate && job.last_estimate->relmse) {
      const double relmse = *job.last_estimate->relmse;
      errors += relmse;
      ++estimates;
      s.relmse_max = std::max(s.relmse_max.value_or(0), relmse);
    }
  }
  s.samples_per_second = recent_rate(sequence.recent, now);
  if (estimates > 0) s.relmse_mean = errors / static_cast<double>(estimates);
  if (!sequence.frames.empty()) {
    s.first_frame = sequence.frames.begin()->first;
    s.last_frame = sequence.frames.rbegin()->first;
  }
  s.state = state_of(s);
  const bool more_to_spend = s.request.budget_seconds > 0 && !sequence.budget_spent;
  if (s.state == JobState::kDone && more_to_spend) s.state = JobState::kRunning;
  s.eta_seconds = eta_seconds(sequence, now);
  if (failed) {
    s.message = std::to_string(count(s, JobState::kFailed)) + " failed, first frame " +
                std::to_string(failed->record.frame->number) + ": " + failed->record.message;
  } else if (!is_final(s.state) && sequence.open.empty() && !sequence.waiting.empty()) {
    s.message = jobs_.status(*sequence.waiting.begin()->second, now).message;
  }
  return s;
}

FrameStatus SequenceView::frame_status(const Job& frame, double now) const {
  const JobStatus job = jobs_.status(frame, now);
  FrameStatus s;
  s.number = frame.record.frame->number;
  s.job = job.id;
  s.state = job.state;
  s.message = job.message;
  s.bundle_digest = job.bundle_digest;
  s.spp = job.spp;
  s.packets_done = job.packets_done;
  s.packets_total = job.packets_total;
  s.wall_seconds = job.wall_seconds;
  s.cpu_seconds = job.cpu_seconds;
  s.relmse = job.relmse;
  s.relmse_low = job.relmse_low;
  s.relmse_high = job.relmse_high;
  s.version = job.version;
  return s;
}

void SequenceView::load(const SequenceId& id) const {
  try {
    for (bool all = false; !all;) {
      const std::lock_guard lock(farm_.mutex);
      all = table_.load_curves(table_.get(id), kMostCurvesOfLook);
    }
  } catch (const StoreError&) {  // it is shown without, and the next look tries again
  }
}

SequenceStatus SequenceView::sequence(const SequenceId& id) const {
  load(id);
  const std::lock_guard lock(farm_.mutex);
  return status(table_.get(id), farm_.clock.now());
}

std::vector<SequenceStatus> SequenceView::sequences(size_t begin, size_t count) const {
  std::vector<SequenceStatus> result;
  std::vector<SequenceId> order;
  {
    const std::lock_guard lock(farm_.mutex);
    order = farm_.scheduler.jobs.sequences();
  }
  for (size_t i = begin; i < order.size() && result.size() < count; ++i)  // a lock for each: they may be long
    result.push_back(sequence(order[i]));
  return result;
}

size_t SequenceView::sequence_count() const {
  const std::lock_guard lock(farm_.mutex);
  return farm_.scheduler.jobs.sequences().size();
}

FramePage SequenceView::frames(const SequenceId& id, std::optional<int> after, size_t most,
                               uint64_t version) const {
  load(id);
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  const Sequence& sequence = table_.get(id);
  FramePage page;
  page.total = sequence.frames.size();
  auto at = after ? sequence.frames.upper_bound(*after) : sequence.frames.begin();
  for (; at != sequence.frames.end() && page.frames.size() < most; ++at) {
    if (at->second.job->version > version) page.frames.push_back(frame_status(*at->second.job, now));
  }
  if (at != sequence.frames.end() && !page.frames.empty()) page.last = page.frames.back().number;
  return page;
}

}  // namespace lightmill
