#include "coordinator/service/background.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace lightmill {
namespace {

TEST(Background, DoesEachTaskWhenItIsDueAndTriesAgainAfterATrouble) {
  const FakeClock clock;
  std::atomic<int> often = 0, once = 0, troubles = 0;
  {
    Background background(clock, [&](const std::string&) {
      ++troubles;
      troubles.notify_all();
    });
    background.start({[&](double) { return ++often < 5 ? 0.0 : 1e6; },
                      {},
                      [&](double) -> double {
                        ++once;
                        throw std::runtime_error("disk");
                      }});
    troubles.wait(0);
  }
  EXPECT_EQ(often, 5);
  EXPECT_EQ(once, 1) << "its time stands still";
  EXPECT_EQ(troubles, 1);
}

TEST(Background, EndsWithoutWork) {
  const FakeClock clock;
  Background idle(clock, {});
  Background none(clock, {});
  none.start({{}});
}

}  // namespace
}  // namespace lightmill
