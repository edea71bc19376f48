#include "coordinator/service/task_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>

namespace lightmill {
namespace {

TEST(TaskPool, RunsAllThatItWasGivenBeforeItEnds) {
  std::atomic<int> done = 0;
  {
    TaskPool pool(3);
    for (int i = 0; i < 1000; ++i) pool.run([&] { ++done; });
  }
  EXPECT_EQ(done, 1000);
}

TEST(TaskPool, AsManyBlockAsItMayHaveThreads) {
  constexpr int kThreads = 4;
  std::latch all_inside(kThreads);  // opens only if so many run at once
  std::atomic<int> inside = 0, most = 0;
  {
    TaskPool pool(kThreads);
    for (int i = 0; i < 3 * kThreads; ++i) {
      pool.run([&, i] {
        const int now = ++inside;
        int seen = most;
        while (now > seen && !most.compare_exchange_weak(seen, now)) {
        }
        if (i < kThreads) all_inside.arrive_and_wait();
        --inside;
      });
    }
  }
  EXPECT_EQ(most, kThreads);
}

}  // namespace
}  // namespace lightmill
