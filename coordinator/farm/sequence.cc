#include "coordinator/farm/sequence.h"

#include <algorithm>

#include "coordinator/farm/job_progress.h"

namespace lightmill {
void Sequence::add(Job& frame) {
  const size_t place_in_line = frames.size();
  frames[frame.record.frame->number] = {&frame,
                                        {frame_pass(record.request.order, place_in_line), place_in_line}};
  place(frame);
}

void Sequence::place(Job& frame) {
  const Turn turn = frames.at(frame.record.frame->number).turn;
  const JobState state = frame.record.state;
  if (state != JobState::kQueued) begun = true;
  const auto keep = [&](std::map<Turn, Job*>* set, bool in) {
    if (in) {
      (*set)[turn] = &frame;
    } else {
      set->erase(turn);
    }
  };
  keep(&not_done, state != JobState::kDone);
  keep(&not_final, !is_final(state));
  const bool runnable = is_runnable(frame);
  const bool held = !is_final(state) && frame.tiles.leased_count() > 0;
  if (!runnable && !held) open.erase(turn);
  keep(&waiting, runnable && !open.contains(turn));
}

void Sequence::opened(Job& frame) {
  begun = true;
  const Turn turn = frames.at(frame.record.frame->number).turn;
  if (waiting.erase(turn) > 0) open[turn] = &frame;
}

int Sequence::workers() const {
  int count = 0;
  for (const auto& [turn, frame] : open) count += frame->tiles.workers();
  return count;
}

bool Sequence::has_worker(const WorkerId& worker) const {
  return std::any_of(open.begin(), open.end(),
                     [&](const auto& item) { return item.second->tiles.has_worker(worker); });
}

bool has_ended(const Sequence& sequence) {
  if (sequence.frames.empty() || !sequence.not_final.empty()) return false;
  if (sequence.record.request.budget_seconds == 0 || sequence.budget_spent) return true;
  // Frames of a budget get more samples, unless somebody stopped one.
  return std::any_of(sequence.frames.begin(), sequence.frames.end(),
                     [](const auto& item) { return item.second.job->record.state == JobState::kCancelled; });
}

double missing_samples(const JobRecord& frame) {
  if (is_final(frame.state) || frame.settings.spp >= kMaxSpp) return 0;
  const double total =
      static_cast<double>(frame.settings.spp) * static_cast<double>(frame.settings.grid.crop.area());
  return std::max(0.0, total - static_cast<double>(frame.pixel_samples));
}

double eta_seconds(const Sequence& sequence, double now) {
  const double rate = recent_rate(sequence.recent, now);
  if (sequence.not_final.empty()) return 0;
  double missing = 0;
  for (const auto& [turn, frame] : sequence.not_final) missing += missing_samples(frame->record);
  return rate > 1e-3 && missing > 0 ? missing / rate : -1;
}

}  // namespace lightmill
