#pragma once
// The servers' logs: a line to an event on stderr, as text for people or as JSON for machines, through
// spdlog.
//
//   start_log("worker", "info", "json");
//   const LogScope scope({.job = "j1", .tile = 3, .attempt = 1, .worker = "w2"});
//   spdlog::warn("lease lost");     // {"time": ..., "message": "lease lost", "job": "j1", "tile": 3, ...}
#include <cstdint>
#include <string>

namespace lightmill {

/// Whom or what a line is about. Empty members are left out.
struct LogContext {
  std::string job{};
  int64_t tile = -1;
  int64_t attempt = 0;
  std::string worker{};
};

/// Lines of this thread are about `context` until the scope ends; scopes nest, the innermost counts. A member
/// that it leaves empty is the outer one's.
class LogScope {
 public:
  explicit LogScope(LogContext context);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;

 private:
  LogContext outer_;
};

/// That of the calling thread.
const LogContext& log_context();

/// Makes spdlog's default logger one that writes to stderr. `level` is "debug", "info", "warn" or "error";
/// `format` is "text" or "json", else Error(kUsage).
void start_log(const std::string& program, const std::string& level, const std::string& format);

}  // namespace lightmill
