#pragma once
// Decoders of partials for whoever commits: as many are kept as processors could use, within kMostBytes.
//
//   DecoderPool::Loan decoder = pool.lend();
//   const Partial& partial = decoder->decode(bytes, grid, tile);      // until the loan ends
#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/image/partial_decoder.h"

namespace lightmill {

/// Thread-safe.
class DecoderPool {
 public:
  static constexpr size_t kMostBytes = size_t{128} << 20;  // kept while nobody uses them

  class Loan {
   public:
    Loan(DecoderPool& pool, std::unique_ptr<PartialDecoder> decoder)
        : pool_(&pool), decoder_(std::move(decoder)) {}
    Loan(Loan&&) noexcept = default;
    Loan& operator=(Loan&&) = delete;
    ~Loan() {
      if (decoder_) pool_->take_back(std::move(decoder_));
    }
    PartialDecoder* operator->() const { return decoder_.get(); }

   private:
    DecoderPool* pool_;
    std::unique_ptr<PartialDecoder> decoder_;
  };

  Loan lend() {
    const std::lock_guard lock(mutex_);
    if (spare_.empty()) return {*this, std::make_unique<PartialDecoder>()};
    std::unique_ptr<PartialDecoder> decoder = std::move(spare_.back());
    spare_.pop_back();
    bytes_ -= decoder->bytes();
    return {*this, std::move(decoder)};
  }
  /// Of the decoders that nobody uses.
  size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }

 private:
  void take_back(std::unique_ptr<PartialDecoder> decoder) {
    const size_t bytes = decoder->bytes();
    const std::lock_guard lock(mutex_);
    if (spare_.size() >= most_ || bytes_ + bytes > kMostBytes) return;  // the decoder goes after the lock
    bytes_ += bytes;
    spare_.push_back(std::move(decoder));
  }

  const size_t most_ = std::max(1u, std::thread::hardware_concurrency());
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<PartialDecoder>> spare_;  // guarded by mutex_
  size_t bytes_ = 0;                                    // of spare_
};

}  // namespace lightmill
