#pragma once
// Deadlines: whether a job, or a sequence as a whole, will be done in time at the rate that it has. Pure.
//
// One that will not, or of which nobody knows as it has no rate, is late. Late ones come before the others of
// their submitter (scheduler.cc), which is what raises their rate; other submitters keep their share.
#include "coordinator/farm/sequence.h"

namespace lightmill {

// `due` and `now` are clock times. Looks once a second, and remembers the answer.
const Punctuality& look_at_deadline(const Job& job, double due, double now);
const Punctuality& look_at_deadline(const Sequence& sequence, double due, double now);

}  // namespace lightmill
