#include "coordinator/core/sequences/budget_keeper.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr size_t kFramesAhead = 2, kMostFramesAhead = 64;
constexpr size_t kMostCurves = 500;  // that are read at once, after a restart

/// What the frame is expected to cost from now on, processor seconds; 0 once it has ended.
double expected_seconds(const JobRecord& frame) {
  if (frame.pixel_samples == 0) return 0;
  return frame.cpu_seconds * missing_samples(frame) / static_cast<double>(frame.pixel_samples);
}

}  // namespace

BudgetKeeper::BudgetKeeper(FarmState& farm, JobTable& jobs, JobDesk& desk)
    : farm_(farm), jobs_(jobs), desk_(desk) {}

void BudgetKeeper::spend() {
  const std::lock_guard lock(farm_.mutex);
  if (farm_.health.fault()) return;
  for (const SequenceId& id : farm_.scheduler.jobs.sequences()) {
    Sequence& sequence = *farm_.scheduler.jobs.find(id);
    if (sequence.record.request.budget_seconds > 0 && !sequence.budget_spent)
      spend(sequence, farm_.clock.now());
  }
}

Job* BudgetKeeper::next_frame(const Sequence& sequence, double left) {
  Job* best = nullptr;
  double most = 0;
  for (const auto& [number, frame] : sequence.frames) {
    const JobRecord& record = frame.job->record;
    const bool has_estimate = frame.job->last_estimate && frame.job->last_estimate->relmse;
    if (record.state != JobState::kDone || record.target_met || !has_estimate) continue;
    if (record.settings.spp >= sequence.record.request.most_spp || record.cpu_seconds > left) continue;
    const double gain = *frame.job->last_estimate->relmse / std::max(record.cpu_seconds, 1e-6);
    if (!best || gain > most) {
      best = frame.job;
      most = gain;
    }
  }
  return best;
}

void BudgetKeeper::spend(Sequence& sequence, double now) {
  size_t runnable = sequence.open.size() + sequence.waiting.size();
  const size_t wanted = std::min(kMostFramesAhead, kFramesAhead + farm_.scheduler.workers.all().size());
  if (runnable >= wanted || !jobs_.load_curves(sequence, kMostCurves)) return;
  double left = sequence.record.request.budget_seconds;
  bool stopped = false;
  for (const auto& [number, frame] : sequence.frames) {
    const JobRecord& record = frame.job->record;
    left -= record.cpu_seconds + expected_seconds(record);
    stopped = stopped || record.state == JobState::kCancelled || record.state == JobState::kPaused;
  }
  if (stopped) return;  // whoever stopped frames wants no others
  while (runnable < wanted) {
    Job* const frame = next_frame(sequence, left);
    if (!frame) {
      if (runnable > 0 || sequence.not_final.size() > 0) return;
      sequence.budget_spent = true;
      farm_.touch_quietly(*sequence.frames.begin()->second.job);
      return;
    }
    RenderSettings more = frame->record.settings;
    more.spp = std::min(2 * more.spp, sequence.record.request.most_spp);
    left -= frame->record.cpu_seconds;
    jobs_.update(*frame, desk_.extended(*frame, more, now), now);
    ++runnable;
  }
}

}  // namespace lightmill
