#pragma once
// The newest lines that an operator should know, kept in memory for the dashboard. Thread-safe.
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

namespace lightmill {

class EventLog {
 public:
  static constexpr size_t kMaxLines = 2000;
  static constexpr size_t kMaxLineBytes = 1000;

  struct Line {
    uint64_t number = 0;  // from 1, without gaps
    double time = 0;      // seconds since 1970
    std::string text;
  };

  /// Adds a line, cut if it is long. Forgets the oldest line beyond kMaxLines.
  void add(std::string text);
  /// The lines with a number above `number` that are still there, oldest first.
  std::vector<Line> after(uint64_t number) const;
  /// Number of the newest line; 0 before the first.
  uint64_t newest() const;

 private:
  mutable std::mutex mutex_;
  std::deque<Line> lines_;
  uint64_t newest_ = 0;
};

}  // namespace lightmill
