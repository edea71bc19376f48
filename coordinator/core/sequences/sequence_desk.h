#pragma once
// What clients do to sequences. Farm's methods of the same names say what each does; all throw
// UnknownSequence.
//
// A change of all frames is made in parts: others get at the farm in between, and after a crash part of the
// frames has it. Each part is one transaction. Doing it once more does the rest.
//
// The caller must not hold FarmState::mutex.
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/farm/sequence_types.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_desk.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/round_ends.h"

namespace lightmill {

class SequenceDesk {
 public:
  SequenceDesk(FarmState& farm, JobTable& jobs, RoundEnds& ends, JobDesk& desk)
      : farm_(farm), jobs_(jobs), ends_(ends), desk_(desk) {}

  SequenceId submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames);
  void add_frames(const SequenceId& id, const std::vector<FrameRequest>& frames);
  void pause(const SequenceId& id);
  void resume(const SequenceId& id);
  void cancel(const SequenceId& id);
  void retry(const SequenceId& id);
  void set_priority(const SequenceId& id, int priority);
  void extend(const SequenceId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);

 private:
  /// Rows of the frames, and manifests of their bundles.
  static std::vector<NewJob> rows_of(const SequenceRecord& sequence, const std::vector<FrameRequest>& frames);
  void store_frames(const SequenceId& id, std::vector<NewJob> frames);
  /// The sequence has no budget any more. True if it had, and it was not spent.
  bool end_budget(const SequenceId& id);
  // FarmState::mutex held:
  /// Whether the frame is there already, just as it is. Throws Error(kUsage) if another one has its number.
  static bool is_there(const Sequence& sequence, const JobRecord& frame);

  /// A frame's row after the change; empty if its state does not allow it.
  using Change = std::function<std::optional<JobRecord>(Job& frame, double now)>;
  /// Changes all frames that allow it, so many under one lock. Throws Error(kFailed) if there is none:
  /// "no frame of sequence s3 is <wanted>".
  void change_all(const SequenceId& id, size_t part, const std::string& wanted, const Change& change);

  FarmState& farm_;
  JobTable& jobs_;
  RoundEnds& ends_;
  JobDesk& desk_;
};

}  // namespace lightmill
