#pragma once
// A bound on the bytes that many hold together.
#include <atomic>
#include <cstdint>

namespace lightmill {

/// Bytes that a call may hold, given back on every way out.
class Reservation {
 public:
  Reservation(std::atomic<uint64_t>& total, uint64_t most) : total_(total), most_(most) {}
  ~Reservation() { total_ -= bytes_; }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;
  /// Takes as many more. False if that is too much for all together; a single one always fits.
  bool take(uint64_t bytes) {
    bytes_ += bytes;
    return (total_ += bytes) <= most_ || total_ == bytes_;
  }

 private:
  std::atomic<uint64_t>& total_;
  const uint64_t most_;
  uint64_t bytes_ = 0;
};

}  // namespace lightmill
