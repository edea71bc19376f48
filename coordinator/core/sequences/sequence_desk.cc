#include "coordinator/core/sequences/sequence_desk.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "common/base/utf8.h"
#include "coordinator/core/sequences/budget_keeper.h"
#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr size_t kMaxSequences = 10000;
// Frames that are changed under one lock, and that are looked at; of those whose ledger has to be read fewer.
constexpr size_t kPart = 100, kLooks = 2000, kPartWithLedgers = 16;
constexpr double kMaxFps = 1e6, kMaxBudgetSeconds = 1e12;

void check_sequence(const SequenceRequest& request) {
  if (!(request.fps > 0 && request.fps <= kMaxFps))
    throw Error(ErrorKind::kUsage, "a sequence has above 0 and at most 1000000 frames a second");
  if (!(request.budget_seconds >= 0 && request.budget_seconds <= kMaxBudgetSeconds))
    throw Error(ErrorKind::kUsage, "a budget is a number of processor seconds from 0 to 1e12");
  if (request.most_spp < 1 || request.most_spp > kMaxSpp)
    throw Error(ErrorKind::kUsage, "the most samples of a budget's frames must be 1 or more");
}

}  // namespace

std::vector<NewJob> SequenceDesk::rows_of(const SequenceRecord& sequence,
                                          const std::vector<FrameRequest>& frames) {
  if (frames.empty() || frames.size() > kMaxFramesOfCall) {
    throw Error(ErrorKind::kUsage, "1 to " + std::to_string(kMaxFramesOfCall) +
                                       " frames come in one call, not " + std::to_string(frames.size()) +
                                       "; add the others by further calls");
  }
  std::vector<NewJob> rows;
  std::set<int> numbers;
  for (const FrameRequest& frame : frames) {
    if (!numbers.insert(frame.number).second)
      throw Error(ErrorKind::kUsage, "frame " + std::to_string(frame.number) + " is there twice");
    JobRequest job;
    job.name = sequence.request.name;
    job.bundle = frame.bundle;
    job.settings = frame.settings;
    if (sequence.request.budget_seconds > 0)
      job.settings.spp = std::min({job.settings.spp, BudgetKeeper::kFirstSamples, sequence.request.most_spp});
    job.priority = sequence.request.priority;
    job.pool = sequence.request.pool;
    job.submitter = sequence.request.submitter;
    job.max_workers = sequence.request.max_workers;
    job.deadline = sequence.request.deadline;
    job.after = sequence.request.after;
    rows.push_back({JobDesk::record_of(job), bundle_to_json(frame.bundle)});
    rows.back().record.frame = FrameOf{sequence.id, frame.number};
  }
  return rows;
}

SequenceId SequenceDesk::submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames) {
  check_sequence(request);
  SequenceRecord record{{}, request};
  record.request.name = printable_line(request.name, kMaxNameBytes);
  record.request.pool = printable_line(request.pool, kMaxNameBytes);
  record.request.submitter = printable_line(request.submitter, kMaxNameBytes);
  std::vector<NewJob> rows = rows_of(record, frames);
  {
    const std::lock_guard lock(farm_.mutex);
    desk_.require_known(request.after);
    desk_.require_room(rows.size(), 1);
    if (farm_.scheduler.jobs.sequences().size() >= kMaxSequences) {
      ++farm_.stats.refusals["job_limit"];
      throw LimitReached("the coordinator has its limit of " + std::to_string(kMaxSequences) +
                         " sequences; start one with a new data folder");
    }
    record.id = SequenceId{farm_.new_id("s", "sequence")};
    record.ends.count = farm_.options.tells_ends ? 1 : 0;
    farm_.store->save_sequence(record);
    farm_.scheduler.jobs.add(record);
  }
  for (NewJob& row : rows) row.record.frame->sequence = record.id;
  store_frames(record.id, std::move(rows));
  return record.id;
}

void SequenceDesk::add_frames(const SequenceId& id, const std::vector<FrameRequest>& frames) {
  SequenceRecord record;
  {
    const std::lock_guard lock(farm_.mutex);
    record = jobs_.get(id).record;
  }
  store_frames(id, rows_of(record, frames));
}

bool SequenceDesk::is_there(const Sequence& sequence, const JobRecord& frame) {
  const auto found = sequence.frames.find(frame.frame->number);
  if (found == sequence.frames.end()) return false;
  // A call whose answer was lost comes again. What extend and the pilot may have changed is no difference.
  if (found->second.job->record.bundle_digest == frame.bundle_digest) return true;
  throw Error(ErrorKind::kUsage, "sequence " + sequence.record.id.value + " has another frame " +
                                     std::to_string(frame.frame->number) +
                                     "; submit a new sequence, or give it another number");
}

void SequenceDesk::store_frames(const SequenceId& id, std::vector<NewJob> frames) {
  for (size_t at = 0; at < frames.size(); at += kPart) {
    const std::lock_guard lock(farm_.mutex);
    Sequence& sequence = jobs_.get(id);
    std::vector<NewJob> fresh;
    for (size_t i = at; i < std::min(frames.size(), at + kPart); ++i) {
      JobRecord& record = frames[i].record;
      if (is_there(sequence, record)) continue;
      record.id = frame_job(*record.frame);
      record.priority = sequence.record.request.priority;  // it may have changed meanwhile
      fresh.push_back(std::move(frames[i]));
    }
    if (sequence.frames.size() + fresh.size() > kMaxFrames) {
      throw LimitReached("a sequence has at most " + std::to_string(kMaxFrames) +
                         " frames; submit the others as a sequence of their own");
    }
    desk_.require_room(fresh.size(), 0);
    sequence.budget_spent = false;
    farm_.store->add_jobs(fresh);
    for (NewJob& row : fresh) {
      Job job;
      job.record = std::move(row.record);
      farm_.touch(farm_.scheduler.add(std::move(job)));
    }
  }
}

void SequenceDesk::change_all(const SequenceId& id, size_t part, const std::string& wanted,
                              const Change& change) {
  bool any = false;
  std::optional<int> last;
  for (bool more = true; more;) {
    const std::lock_guard lock(farm_.mutex);
    const double now = farm_.clock.now();
    Sequence& sequence = jobs_.get(id);
    std::vector<JobTable::Change> changes;
    size_t looks = 0;
    auto at = last ? sequence.frames.upper_bound(*last) : sequence.frames.begin();
    for (; at != sequence.frames.end() && changes.size() < part && ++looks <= kLooks; ++at) {
      last = at->first;
      Job& frame = *at->second.job;
      if (std::optional<JobRecord> record = change(frame, now))
        changes.push_back({&frame, std::move(*record)});
    }
    more = at != sequence.frames.end();
    any = any || !changes.empty();
    if (!changes.empty()) jobs_.update_all(std::move(changes), now);
  }
  if (any) return;
  throw Error(ErrorKind::kFailed, "no frame of sequence " + id.value + " is " + wanted);
}

void SequenceDesk::pause(const SequenceId& id) {
  change_all(id, kPart, "queued or running",
             [](Job& frame, double now) { return JobDesk::paused(frame, now); });
}

void SequenceDesk::resume(const SequenceId& id) {
  change_all(id, kPart, "paused", [](Job& frame, double) { return JobDesk::resumed(frame); });
}

void SequenceDesk::retry(const SequenceId& id) {
  change_all(id, kPartWithLedgers, "failed or cancelled",
             [this](Job& frame, double) { return desk_.retried(frame); });
}

bool SequenceDesk::end_budget(const SequenceId& id) {
  const std::lock_guard lock(farm_.mutex);
  Sequence& sequence = jobs_.get(id);
  if (sequence.record.request.budget_seconds == 0) return false;
  SequenceRecord record = sequence.record;
  record.request.budget_seconds = 0;
  farm_.store->save_sequence(record);
  sequence.record = std::move(record);
  return !sequence.budget_spent;
}

void SequenceDesk::cancel(const SequenceId& id) {
  for (bool any = end_budget(id);; any = true) {
    const std::lock_guard lock(farm_.mutex);
    Sequence& sequence = jobs_.get(id);
    if (sequence.not_final.empty()) {
      if (any) return;
      throw Error(ErrorKind::kFailed, "no frame of sequence " + id.value + " is queued, running or paused");
    }
    std::vector<Job*> frames;
    // The last ones first: nobody shall begin a frame that is about to be cancelled.
    for (auto at = sequence.not_final.rbegin(); at != sequence.not_final.rend() && frames.size() < kPart;
         ++at)
      frames.push_back(at->second);
    jobs_.end_all(frames, JobState::kCancelled, "cancelled by a client", farm_.clock.now());
  }
}

void SequenceDesk::set_priority(const SequenceId& id, int priority) {
  const std::lock_guard lock(farm_.mutex);
  Sequence& sequence = jobs_.get(id);
  SequenceRecord record = sequence.record;
  record.request.priority = priority;
  farm_.store->save_sequence(record);
  farm_.scheduler.withdraw(sequence);
  sequence.record = std::move(record);
  for (auto& [number, frame] : sequence.frames) frame.job->record.priority = priority;
  if (!sequence.frames.empty()) farm_.touch(*sequence.frames.begin()->second.job);
}

void SequenceDesk::extend(const SequenceId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                          std::optional<double> target_error) {
  change_all(id, kPartWithLedgers, "queued, running, paused or done",
             [&](Job& frame, double now) -> std::optional<JobRecord> {
               const JobState state = frame.record.state;
               if (state == JobState::kFailed || state == JobState::kCancelled) return std::nullopt;
               return desk_.extended(
                   frame, JobDesk::with_totals(frame.record.settings, spp, time_s, target_error), now);
             });
  ends_.settle_complete();
}

}  // namespace lightmill
