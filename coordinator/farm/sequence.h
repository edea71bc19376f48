#pragma once
// A sequence as the scheduler sees it: which of its frames are being rendered, and which comes next. Pure.
//
// A sequence may have thousands of frames, and a worker that asks must not wait until all were looked at. So
// only those that somebody works on are open; the others wait in the order of their turn, and the next one
// opens when those that are open have nothing left to lease.
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "coordinator/farm/job.h"

namespace lightmill {

struct Sequence {
  explicit Sequence(SequenceRecord of) : record(std::move(of)) {}

  /// When a frame's turn comes: those of the first pass first, then in the order in which they were added.
  using Turn = std::pair<int, size_t>;

  SequenceRecord record;
  JobShare share;
  RecentSamples recent;  // over all frames
  mutable Punctuality punctuality;
  uint64_t version = 0;
  struct Frame {
    Job* job = nullptr;
    Turn turn;
  };
  std::map<int, Frame> frames;   // all, by number
  std::map<Turn, Job*> open;     // somebody works on them, or has; paused ones while they are leased
  std::map<Turn, Job*> waiting;  // others that could be rendered
  std::map<Turn, Job*> not_done;
  std::map<Turn, Job*> not_final;
  bool begun = false;         // a tile of a frame was leased
  bool budget_spent = false;  // what is left of it is not enough for more samples

  /// Adds the next frame.
  void add(Job& frame);
  /// To be called after the frame's state, or whether it can be rendered, was changed.
  void place(Job& frame);
  /// A tile of the frame was leased.
  void opened(Job& frame);
  /// Holders of tiles, over all open frames.
  int workers() const;
  bool has_worker(const WorkerId& worker) const;
};

/// Nothing happens to it by itself any more.
bool has_ended(const Sequence& sequence);
/// Camera samples that a frame lacks up to its total; 0 if other rules will end it.
double missing_samples(const JobRecord& frame);
/// Remaining seconds until all frames have their samples, at the present rate; -1 if unknown.
double eta_seconds(const Sequence& sequence, double now);

}  // namespace lightmill
