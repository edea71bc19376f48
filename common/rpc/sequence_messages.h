#pragma once
// Sequences as messages of proto/lightmill/v1/sequence.proto; the rules are those of convert.h.
#include "common/farm/sequence_types.h"
#include "lightmill/v1/sequence.pb.h"

namespace lightmill {

v1::FrameOrder to_proto(FrameOrder order);
/// kSequential where it is not given.
FrameOrder from_proto(v1::FrameOrder order);

v1::SequenceStatus to_proto(const SequenceStatus& status);
SequenceStatus from_proto(const v1::SequenceStatus& message);

v1::FrameStatus to_proto(const FrameStatus& status);
FrameStatus from_proto(const v1::FrameStatus& message);

}  // namespace lightmill
