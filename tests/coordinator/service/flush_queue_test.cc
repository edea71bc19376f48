#include "coordinator/merge/flush_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>

namespace lightmill {
namespace {

TEST(FlushQueue, WhoComesDuringAFlushSharesTheNextOne) {
  std::promise<void> first_flush, go_on;
  std::atomic<int> flushes = 0, answered = 0;
  {
    FlushQueue queue([&] {
      if (++flushes > 1) return;
      first_flush.set_value();
      go_on.get_future().wait();
    });
    const auto count = [&](const std::exception_ptr& failure) { answered += failure ? 1000 : 1; };
    queue.when_durable(count);
    first_flush.get_future().wait();
    for (int i = 0; i < 20; ++i) queue.when_durable(count);
    EXPECT_EQ(answered, 0) << "nobody is answered before the disk has it";
    go_on.set_value();
  }
  EXPECT_EQ(answered, 21);
  EXPECT_EQ(flushes, 2);
}

TEST(FlushQueue, EveryWaiterSeesOnlyWhatWasWrittenBeforeItCame) {
  std::atomic<int64_t> written = 0, durable = 0;
  std::atomic<int> too_early = 0;
  {
    FlushQueue queue([&] { durable = written.load(); });
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&] {
        for (int i = 0; i < 500; ++i) {
          const int64_t mine = ++written;
          queue.when_durable([&, mine](const std::exception_ptr&) { too_early += durable < mine; });
        }
      });
    }
  }
  EXPECT_EQ(too_early, 0);
}

TEST(FlushQueue, AFailureGoesToThoseWhoWaitedForItAlone) {
  std::promise<std::exception_ptr> first, second;
  int flushes = 0;
  FlushQueue queue([&] {
    if (++flushes == 1) throw std::runtime_error("disk full");
  });
  queue.when_durable([&](const std::exception_ptr& failure) { first.set_value(failure); });
  EXPECT_THROW(std::rethrow_exception(first.get_future().get()), std::runtime_error);
  queue.when_durable([&](const std::exception_ptr& failure) { second.set_value(failure); });
  EXPECT_EQ(second.get_future().get(), nullptr);
}

}  // namespace
}  // namespace lightmill
