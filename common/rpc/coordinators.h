#pragma once
// The coordinators of a farm, as --coordinator names them: one, or several of which one leads while the
// others stand by (coordinator/leadership.h). Whoever finds that one does not answer, or stands by, moves on
// to the next. Thread-safe.
#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

namespace lightmill {

class Coordinators {
 public:
  /// "HOST:PORT" or "HOST:PORT,HOST:PORT,...". Throws Error(kUsage).
  explicit Coordinators(const std::string& list);
  size_t size() const { return addresses_.size(); }
  const std::string& address(size_t index) const { return addresses_[index]; }
  /// The one to call.
  size_t current() const { return current_; }
  /// `tried` did not answer. Calls that failed at the same time count once.
  void move_on(size_t tried);

 private:
  std::vector<std::string> addresses_;
  std::atomic<size_t> current_ = 0;
};

}  // namespace lightmill
