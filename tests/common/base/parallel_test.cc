#include "common/base/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace lightmill {
namespace {

TEST(ParallelFor, CallsEveryIndexOnce) {
  for (const int threads : {0, 1, 2, 7}) {
    for (const size_t count : {0, 1, 2, 1000}) {
      std::vector<std::atomic<int>> calls(count);
      parallel_for(count, threads, [&](size_t i) { ++calls[i]; });
      for (size_t i = 0; i < count; ++i) EXPECT_EQ(calls[i], 1) << i << " of " << count;
    }
  }
}

TEST(ParallelFor, ThrowsWhatAPlainLoopWouldThrow) {
  for (int run = 0; run < 200; ++run) {
    std::vector<std::atomic<int>> calls(100);
    try {
      parallel_for(calls.size(), 4, [&](size_t i) {
        ++calls[i];
        if (i == 60 || i == 41 || i == 43) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "41");
    }
    for (size_t i = 0; i <= 41; ++i) EXPECT_EQ(calls[i], 1);
  }
}

}  // namespace
}  // namespace lightmill
