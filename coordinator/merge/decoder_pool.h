#pragma once
// Decoders of partials for commits. As many are kept as processors could use, within kMostBytes. As many are
// lent as their partials, unpacked, fit into a bound. Beyond it callers wait, in turn.
//
//   DecoderPool pool(512e6);
//   DecoderPool::Loan decoder = pool.lend(200e6);
//   const Partial& partial = decoder->decode(bytes, grid, tile);      // until the loan ends
#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/film/partial_decoder.h"

namespace lightmill {

/// Thread-safe.
class DecoderPool {
 public:
  static constexpr size_t kMostBytes = size_t{128} << 20;  // kept while nobody uses them

  class Loan {
   public:
    Loan(DecoderPool& pool, std::unique_ptr<PartialDecoder> decoder, double bytes)
        : pool_(&pool), decoder_(std::move(decoder)), bytes_(bytes) {}
    Loan(Loan&&) noexcept = default;
    Loan& operator=(Loan&&) = delete;
    ~Loan() {
      if (decoder_) pool_->take_back(std::move(decoder_), bytes_);
    }
    PartialDecoder* operator->() const { return decoder_.get(); }

   private:
    DecoderPool* pool_;
    std::unique_ptr<PartialDecoder> decoder_;
    double bytes_;
  };

  explicit DecoderPool(double most_lent_bytes) : most_lent_(most_lent_bytes) {}
  /// Lends a decoder for a partial of about `bytes` bytes unpacked. One that is larger than the bound is
  /// alone. The borrower must not wait for another loan.
  Loan lend(double bytes) {
    std::unique_lock lock(mutex_);
    const uint64_t turn = last_turn_++;
    free_.wait(lock, [&] { return turn == turn_ && (lent_ == 0 || lent_bytes_ + bytes <= most_lent_); });
    ++turn_;
    ++lent_;
    lent_bytes_ += bytes;
    free_.notify_all();  // the next one may fit, too
    if (spare_.empty()) return {*this, std::make_unique<PartialDecoder>(), bytes};
    std::unique_ptr<PartialDecoder> decoder = std::move(spare_.back());
    spare_.pop_back();
    bytes_ -= decoder->bytes();
    return {*this, std::move(decoder), bytes};
  }
  /// Bytes of the decoders that nobody uses.
  size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }

 private:
  void take_back(std::unique_ptr<PartialDecoder> decoder, double lent_bytes) {
    const size_t bytes = decoder->bytes();
    const std::lock_guard lock(mutex_);
    lent_bytes_ -= lent_bytes;
    if (--lent_ == 0) lent_bytes_ = 0;
    free_.notify_all();
    if (spare_.size() >= most_ || bytes_ + bytes > kMostBytes) return;  // the decoder goes after the lock
    bytes_ += bytes;
    spare_.push_back(std::move(decoder));
  }

  const double most_lent_;
  const size_t most_ = std::max(1u, std::thread::hardware_concurrency());
  mutable std::mutex mutex_;
  std::condition_variable free_;
  // Guarded by mutex_.
  int lent_ = 0;
  double lent_bytes_ = 0;
  uint64_t turn_ = 0, last_turn_ = 0;  // who is next, and who comes next
  std::vector<std::unique_ptr<PartialDecoder>> spare_;
  size_t bytes_ = 0;  // of spare_
};

}  // namespace lightmill
