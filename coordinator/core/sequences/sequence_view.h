#pragma once
// Sequences as clients see them. Farm's methods of the same names say what each does. The caller must not
// hold FarmState::mutex. A sequence is summed up when somebody asks: 20,000 frames take a few milliseconds.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/farm/sequence_types.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/farm_view.h"

namespace lightmill {

class SequenceView {
 public:
  SequenceView(FarmState& farm, JobTable& table, FarmView& jobs) : farm_(farm), table_(table), jobs_(jobs) {}

  SequenceStatus sequence(const SequenceId& id) const;
  std::vector<SequenceStatus> sequences(size_t begin, size_t count) const;
  size_t sequence_count() const;
  FramePage frames(const SequenceId& id, std::optional<int> after, size_t most, uint64_t version) const;

 private:
  /// Reads what memory lacks of its frames' errors, in parts. FarmState::mutex not held.
  void load(const SequenceId& id) const;
  // FarmState::mutex held:
  SequenceStatus status(const Sequence& sequence, double now) const;
  FrameStatus frame_status(const Job& frame, double now) const;

  FarmState& farm_;
  JobTable& table_;
  FarmView& jobs_;
};

}  // namespace lightmill
