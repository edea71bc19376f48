#include "coordinator/service/limits/answer_memory.h"

#include <chrono>

#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr std::chrono::milliseconds kLookAgain(50);

}  // namespace

std::shared_ptr<const void> AnswerMemory::take(uint64_t bytes) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(kPatienceSeconds));
  std::unique_lock lock(mutex_);
  while (!fits(bytes)) {
    if (Clock::now() >= end)
      throw LimitReached(
          "images and ledgers that are being sent fill the coordinator's memory for them; try again");
    lock.unlock();
    make_room_();
    lock.lock();
    room_.wait_for(lock, kLookAgain, [&] { return fits(bytes); });
  }
  taken_ += bytes;
  return {this, [this, bytes](const void*) {
            const std::lock_guard own(mutex_);
            taken_ -= bytes;
            room_.notify_all();
          }};
}

}  // namespace lightmill
