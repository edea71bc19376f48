#pragma once
// Who is told when a job or sequence ends: a program on the web, or a command.
#include <atomic>
#include <memory>
#include <string>

#include "coordinator/hooks/webhook_signature.h"

namespace lightmill {

/// The same in each try. Whoever gets it twice knows it by its id.
struct HookMessage {
  std::string id;       // "j7.1": the first end of job j7
  std::string type;     // "job.done", "job.failed", "job.cancelled", "sequence.done", ...
  std::string subject;  // "j7", "s3"
  std::string body;     // JSON: type, timestamp, data
};

class Hook {
 public:
  virtual ~Hook() = default;
  /// For logs.
  virtual std::string name() const = 0;
  /// Blocks until it has taken the message. Throws Error(kFailed) if it did not, in one line.
  virtual void tell(const HookMessage& message) = 0;
  /// Makes tell() give up, now and later; from any thread.
  virtual void stop() = 0;
};

/// `what` is an http or https URL, or else a command for the shell. Throws Error(kUsage) for one that can't
/// be called.
std::unique_ptr<Hook> make_hook(const std::string& what, const WebhookSecret& secret);

}  // namespace lightmill
