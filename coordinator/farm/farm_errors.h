#pragma once
// What the farm refuses, as types: a caller that answers each in its own way catches them.
#include <string>

#include "common/base/error.h"
#include "common/base/ids.h"
#include "common/farm/sequence_types.h"

namespace lightmill {

/// The coordinator does not know this job (services answer NOT_FOUND).
class UnknownJob : public Error {
 public:
  explicit UnknownJob(const JobId& id)
      : Error(ErrorKind::kFailed, "no job \"" + id.value + "\"; see `lightmill jobs`") {}
};
/// The coordinator does not know this sequence (services answer NOT_FOUND).
class UnknownSequence : public Error {
 public:
  explicit UnknownSequence(const SequenceId& id)
      : Error(ErrorKind::kFailed, "no sequence \"" + id.value + "\"; see `lightmill sequences`") {}
};
/// The coordinator does not know this worker, because it was restarted: it must register again.
class UnknownWorker : public Error {
 public:
  explicit UnknownWorker(const WorkerId& id)
      : Error(ErrorKind::kUnreachable, "worker \"" + id.value + "\" is not registered; register again") {}
};
/// A bound was met (too many jobs or workers).
class LimitReached : public Error {
 public:
  explicit LimitReached(const std::string& message) : Error(ErrorKind::kUnreachable, message) {}
};

}  // namespace lightmill
