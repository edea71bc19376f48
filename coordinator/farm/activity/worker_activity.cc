#include "coordinator/farm/activity/worker_activity.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

int64_t WorkerActivity::cell_of(double now) { return static_cast<int64_t>(std::floor(now / kCellSeconds)); }

void WorkerActivity::begin(const JobId& job, double now) {
  advance(now);
  held_.push_back(job);
}

void WorkerActivity::end(const JobId& job, bool delivered, double now) {
  advance(now);
  const auto found = std::find(held_.begin(), held_.end(), job);
  if (found == held_.end()) return;
  held_.erase(found);
  if (!delivered) return;
  // At the very end of a cell, which is closed by now.
  const bool is_over = parts_.empty() && !spans_.empty() && spans_.back().job == job;
  ++(is_over ? spans_.back().tiles : part(job).tiles);
}

WorkerActivity::Part& WorkerActivity::part(const JobId& job) {
  const auto found =
      std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) { return part.job == job; });
  if (found != parts_.end()) return *found;
  if (parts_.size() < kMostJobsOfCell) parts_.push_back({job, 0, 0});
  return parts_.back();
}

void WorkerActivity::advance(double now) {
  const int64_t last = cell_of(now);
  if (last - cell_ > kCells) {  // nobody looked for long: what lies before the hour is not needed
    close_cell();
    cell_ = last - kCells;
    time_ = std::max(time_, static_cast<double>(cell_) * kCellSeconds);
  }
  while (time_ < now) {
    const double end = std::min(now, static_cast<double>(cell_ + 1) * kCellSeconds);
    if (!held_.empty()) part(held_.front()).busy_seconds += end - time_;
    time_ = end;
    if (cell_of(now) == cell_) break;
    close_cell();
    ++cell_;
  }
}

WorkerActivity::Span WorkerActivity::present() const {
  Span span{{}, cell_, 1, 0, 0};
  double most = -1;
  for (const Part& part : parts_) {
    span.busy_seconds += part.busy_seconds;
    span.tiles += part.tiles;
    if (part.busy_seconds > most) span.job = part.job;
    most = std::max(most, part.busy_seconds);
  }
  return span;
}

void WorkerActivity::close_cell() {
  if (!parts_.empty()) {
    const Span span = present();
    Span* const last = spans_.empty() ? nullptr : &spans_.back();
    if (last && last->job == span.job && last->cell + last->cells == span.cell) {
      ++last->cells;
      last->busy_seconds += span.busy_seconds;
      last->tiles += span.tiles;
    } else {
      spans_.push_back(span);
    }
    parts_.clear();
  }
  while (!spans_.empty() && spans_.front().cell + spans_.front().cells <= cell_ - kCells) spans_.pop_front();
}

std::vector<WorkerActivity::Span> WorkerActivity::spans(double now, int64_t since) {
  advance(now);
  std::vector<Span> result;
  const int64_t oldest = cell_ - kCells;
  for (Span span : spans_) {
    if (span.cell + span.cells <= std::max(since, oldest)) continue;
    if (span.cell < oldest) {  // the part that is within the hour
      const auto left = static_cast<double>(span.cell + span.cells - oldest);
      const double share = left / static_cast<double>(span.cells);
      span = {span.job, oldest, span.cell + span.cells - oldest, share * span.busy_seconds,
              std::llround(share * static_cast<double>(span.tiles))};
    }
    result.push_back(span);
  }
  if (parts_.empty()) return result;
  const Span span = present();
  if (!result.empty() && result.back().job == span.job && result.back().cell + result.back().cells == cell_) {
    ++result.back().cells;
    result.back().busy_seconds += span.busy_seconds;
    result.back().tiles += span.tiles;
  } else if (cell_ + 1 > since) {
    result.push_back(span);
  }
  return result;
}

double WorkerActivity::present_seconds(double now) const {
  const auto oldest = static_cast<double>(cell_of(now) - kCells) * kCellSeconds;
  return std::max(0.0, now - std::max(joined_, oldest));
}

double WorkerActivity::busy_seconds(double now) {
  double sum = 0;
  for (const Span& span : spans(now)) sum += span.busy_seconds;
  return sum;
}

}  // namespace lightmill
