#pragma once
// Sequences: the frames of a shot or a turntable, which are submitted, shown and fetched together. Each frame
// is a job of its own, with the bits that it has when it is rendered alone.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/farm/farm_types.h"

namespace lightmill {

/// Coordinator-issued, never reused ("s3").
using SequenceId = StringId<struct SequenceTag>;

/// Which frames come first.
enum class FrameOrder : int {
  kSequential = 0,   // in the order in which they were added
  kCoarseFirst = 1,  // every tenth first, then the others: the motion shows early
};
/// "sequential" or "coarse-first".
const char* frame_order_name(FrameOrder order);
/// Inverse; empty for any other text.
std::optional<FrameOrder> frame_order_from_name(const std::string& name);

/// In which pass the frame comes that was added as number `index`, from 0: those of pass 0 first.
int frame_pass(FrameOrder order, size_t index);

/// Frames of one sequence, and of one call that adds frames.
inline constexpr size_t kMaxFrames = 20000, kMaxFramesOfCall = 1000;

/// Whose frame a job is.
struct FrameOf {
  SequenceId sequence;
  int number = 0;
  bool operator==(const FrameOf&) const = default;
};
/// The id of a frame's job: "s3.17", "s3.-5".
JobId frame_job(const FrameOf& frame);
/// Inverse; empty for the id of any other job.
std::optional<FrameOf> frame_of(const JobId& job);
/// Whether the text has the form of a sequence's id: "s3".
bool is_sequence_id(const std::string& text);

struct SequenceRequest {
  std::string name;
  int priority = 0;  // as in JobRequest, for the sequence as a whole
  std::string pool;
  std::string submitter;
  int max_workers = 0;
  std::vector<JobId> after;
  double deadline = 0;
  FrameOrder order = FrameOrder::kSequential;
  double fps = 24;  // to be played at
  /// Of processor time for all frames together; 0: none. Frames begin with a few samples, and get more, up to
  /// `most_spp`, where their error falls most (coordinator/core/sequences/budget_keeper.h).
  double budget_seconds = 0;
  int64_t most_spp = kMaxSpp;
};

struct FrameRequest {
  int number = 0;
  Bundle bundle;
  RenderSettings settings;
};

/// What a sequence is and how far. Its state is that of its frames: running if one is, else queued, paused,
/// failed or cancelled if one is, else done; but running while a budget has time left for more samples.
struct SequenceStatus {
  SequenceId id;
  SequenceRequest request;
  JobState state = JobState::kQueued;
  /// Frames by state, indexed by JobState.
  int64_t frames[6] = {};
  int64_t frame_count = 0;
  int first_frame = 0, last_frame = 0;  // smallest and largest number
  int64_t packets_done = 0, packets_total = 0;
  double wall_seconds = 0, cpu_seconds = 0;       // sums over the frames
  double samples_per_second = 0;                  // recent
  double eta_seconds = -1;                        // -1: unknown
  std::optional<double> relmse_mean, relmse_max;  // of the frames that have an estimate
  std::string message;                            // why nothing happens, or what failed
  int workers = 0;                                // with leases of its frames; one may count more than once
  uint64_t version = 0;                           // grows with every change of a frame
};

/// A frame among its sequence, as lists show it.
struct FrameStatus {
  int number = 0;
  JobId job;
  JobState state = JobState::kQueued;
  std::string message;
  std::string bundle_digest;
  double spp = 0;
  int64_t packets_done = 0, packets_total = 0;
  double wall_seconds = 0, cpu_seconds = 0;
  std::optional<double> relmse, relmse_low, relmse_high;
  uint64_t version = 0;
};

/// Some frames of a sequence, in the order of their numbers.
struct FramePage {
  std::vector<FrameStatus> frames;
  std::optional<int> last;  // the next page begins after it; empty: there is none
  size_t total = 0;
};

}  // namespace lightmill
