#pragma once
#include <string>

#include "coordinator/hooks/hook.h"

namespace lightmill {

/// Runs a command of the shell, with the message on its standard input and LIGHTMILL_EVENT (the type) and
/// LIGHTMILL_ID (of the job or sequence) in its environment. Taken if it exits with 0 within kSeconds; then
/// it is killed with all that it started.
class CommandHook final : public Hook {
 public:
  static constexpr double kSeconds = 60;

  explicit CommandHook(std::string command) : command_(std::move(command)) {}
  std::string name() const override { return "the command \"" + command_ + "\""; }
  void tell(const HookMessage& message) override;
  void stop() override { stopping_ = true; }

 private:
  const std::string command_;
  std::atomic<bool> stopping_{false};
};

}  // namespace lightmill
