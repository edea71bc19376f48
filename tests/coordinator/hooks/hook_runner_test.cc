// Who is told how often, of farms whose ends stay until they are told.
#include "coordinator/hooks/hook_runner.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <deque>

#include "common/base/error.h"

namespace lightmill {
namespace {

/// Half an hour passes between any two looks at it.
class FastClock : public Clock {
 public:
  double now() const override { return static_cast<double>(1800 * ++looks_); }

 private:
  mutable std::atomic<int64_t> looks_{0};
};

/// Ends that are kept until they are told.
class Ends {
 public:
  explicit Ends(std::vector<EndNote> notes) : notes_(std::move(notes)) {}
  HookNews news() {
    return {[this](size_t most) {
              const std::lock_guard lock(mutex_);
              return std::vector<EndNote>(notes_.begin(),
                                          notes_.begin() + std::min<int64_t>(most, notes_.size()));
            },
            [](const EndNote& note) -> std::optional<HookMessage> {
              if (note.id == "j13") return {};
              return HookMessage{"", "job.done", note.id, "{}"};
            },
            [this](const EndNote& note) {
              const std::lock_guard lock(mutex_);
              if (failures_-- > 0) throw Error(ErrorKind::kFailed, "the disk is full");
              std::erase(notes_, note);
              changed_.notify_all();
            }};
  }
  void wait_for_left(size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return notes_.size() == count; });
  }
  void fail(int times) { failures_ = times; }
  std::vector<EndNote> left() {
    const std::lock_guard lock(mutex_);
    return notes_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<EndNote> notes_;
  int failures_ = 0;
};

/// Notes what it is told; fails so many times first.
class FakeHook final : public Hook {
 public:
  FakeHook(std::vector<std::string>* told, int failures) : told_(told), failures_(failures) {}
  std::string name() const override { return "fake"; }
  void tell(const HookMessage& message) override {
    told_->push_back(message.id);
    if (failures_-- > 0) throw Error(ErrorKind::kFailed, "busy");
  }
  void stop() override {}

 private:
  std::vector<std::string>* told_;
  int failures_;
};

TEST(HookRunner, TellsEachHookUntilItHasTakenTheMessage) {
  FastClock clock;
  Ends ends({{"j1", 1}, {"s2", 3}, {"j13", 1}});
  std::vector<std::string> steady, shaky, log;
  {
    std::vector<std::unique_ptr<Hook>> hooks;
    hooks.push_back(std::make_unique<FakeHook>(&steady, 0));
    hooks.push_back(std::make_unique<FakeHook>(&shaky, 2));
    const HookRunner runner(std::move(hooks), ends.news(), clock,
                            [&](const std::string& line) { log.push_back(line); });
    ends.wait_for_left(1);
  }
  EXPECT_THAT(steady, ::testing::UnorderedElementsAre("j1.1", "s2.3"));
  EXPECT_EQ(shaky.size(), 4u);
  EXPECT_EQ(std::count(shaky.begin(), shaky.end(), "s2.3") + std::count(shaky.begin(), shaky.end(), "j1.1"),
            4);
  ASSERT_FALSE(log.empty());
  EXPECT_THAT(log[0], ::testing::HasSubstr("hook fake: job.done of "));
  EXPECT_THAT(log[0], ::testing::HasSubstr("is tried again: busy"));
}

TEST(HookRunner, GivesUpAfterADay) {
  FastClock clock;
  Ends ends({{"j1", 1}});
  std::vector<std::string> told, log;
  {
    std::vector<std::unique_ptr<Hook>> hooks;
    hooks.push_back(std::make_unique<FakeHook>(&told, 1000000));
    const HookRunner runner(std::move(hooks), ends.news(), clock,
                            [&](const std::string& line) { log.push_back(line); });
    ends.wait_for_left(0);
  }
  EXPECT_GT(told.size(), 10u);
  EXPECT_LT(told.size(), 40u) << "once an hour at last";
  EXPECT_THAT(log.back(), ::testing::HasSubstr("given up after a day: busy"));
  EXPECT_EQ(log.size(), 2u) << "and not a line for each try";
}

TEST(HookRunner, WhatTheStoreCanNotTakeIsTakenLater) {
  FastClock clock;
  Ends ends({{"j1", 1}});
  ends.fail(3);
  std::vector<std::string> told;
  std::vector<std::unique_ptr<Hook>> hooks;
  hooks.push_back(std::make_unique<FakeHook>(&told, 0));
  {
    const HookRunner runner(std::move(hooks), ends.news(), clock, {});
    ends.wait_for_left(0);
  }
  EXPECT_EQ(told, std::vector<std::string>{"j1.1"}) << "once";
}

TEST(HookRunner, NoHooksNoThreads) {
  FastClock clock;
  Ends ends({{"j1", 1}});
  { const HookRunner runner({}, ends.news(), clock, {}); }
  EXPECT_EQ(ends.left().size(), 1u);
}

}  // namespace
}  // namespace lightmill
