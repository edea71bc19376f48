#pragma once
// Time is injected, so that tests simulate it. Seconds since an arbitrary epoch, monotonic.
#include <chrono>

namespace lightmill {

class Clock {
 public:
  virtual ~Clock() = default;
  virtual double now() const = 0;
};

class SteadyClock : public Clock {
 public:
  double now() const override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
};

/// A clock that moves when told to.
class FakeClock : public Clock {
 public:
  double now() const override { return now_; }
  void advance(double seconds) { now_ += seconds; }

 private:
  double now_ = 1000;
};

}  // namespace lightmill
