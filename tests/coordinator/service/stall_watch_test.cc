// Calls of peers that are silent while it is their turn are cut off; those of slow ones are not.
#include "coordinator/service/limits/stall_watch.h"

#include <gtest/gtest.h>

#include <memory>

#include "coordinator/farm/farm_errors.h"
#include "coordinator/service/limits/answer_memory.h"
#include "coordinator/service/worker_keys.h"

namespace lightmill {
namespace {

struct Peer {
  int cuts = 0;
  std::function<void()> when_cut = [] {};
  void TryCancel() {
    ++cuts;
    when_cut();
  }
};

TEST(StallWatch, CutsWhoIsSilentAndNobodyElse) {
  FakeClock clock;
  StallWatch watch(clock, 60, false);
  Peer silent, quick, idle;
  StallWatch::Call a(watch, silent), b(watch, quick), c(watch, idle);
  a.begin();
  b.begin();
  b.end(1);
  clock.advance(59);
  watch.cut_stalled();
  EXPECT_EQ(silent.cuts, 0);
  clock.advance(2);
  watch.cut_stalled();
  EXPECT_EQ(silent.cuts, 1);
  EXPECT_EQ(quick.cuts, 0) << "it is our turn";
  EXPECT_EQ(idle.cuts, 0);
  watch.cut_stalled();
  EXPECT_EQ(silent.cuts, 1) << "once is enough";
  a.end(0);
}

TEST(StallWatch, ATrickleIsNoMovement) {
  FakeClock clock;
  StallWatch watch(clock, 60, false);
  Peer slow, trickling;
  StallWatch::Call a(watch, slow), b(watch, trickling);
  for (int minute = 0; minute < 10; ++minute) {  // a mebibyte and a byte, in fifty seconds each
    a.begin();
    b.begin();
    clock.advance(50);
    watch.cut_stalled();
    a.end(1 << 20);
    b.end(1);
  }
  EXPECT_EQ(slow.cuts, 0) << "21 kB/s";
  EXPECT_GE(trickling.cuts, 1);
}

TEST(StallWatch, ACallMayEndWithinItsCutting) {
  FakeClock clock;
  StallWatch watch(clock, 60, false);
  Peer peer;
  auto call = std::make_unique<StallWatch::Call>(watch, peer);
  peer.when_cut = [&] { call.reset(); };
  call->begin();
  clock.advance(61);
  watch.cut_stalled();
  EXPECT_EQ(peer.cuts, 1);
}

TEST(StallWatch, LooksByItself) {
  const SteadyClock clock;
  StallWatch watch(clock, 0.01);
  std::mutex mutex;
  std::condition_variable changed;
  bool cut = false;
  Peer peer;
  peer.when_cut = [&] {
    const std::lock_guard lock(mutex);
    cut = true;
    changed.notify_all();
  };
  StallWatch::Call call(watch, peer);
  call.begin();
  std::unique_lock lock(mutex);
  EXPECT_TRUE(changed.wait_for(lock, std::chrono::minutes(1), [&] { return cut; }));
}

TEST(StallWatch, TheSlowestMakesRoom) {
  FakeClock clock;
  StallWatch watch(clock, 60, false);
  StallWatch::Group group(watch, 3);
  Peer quick, slow, late, next, more;
  auto a = std::make_unique<StallWatch::Call>(watch, quick, &group);
  auto b = std::make_unique<StallWatch::Call>(watch, slow, &group);
  for (StallWatch::Call* call : {a.get(), b.get()}) call->begin();
  clock.advance(1);
  a->end(10 << 20);
  b->end(1 << 10);
  const StallWatch::Call c(watch, late, &group);
  EXPECT_TRUE(c.admitted());
  EXPECT_EQ(quick.cuts + slow.cuts + late.cuts, 0) << "there is room";
  const StallWatch::Call d(watch, next, &group);
  EXPECT_TRUE(d.admitted());
  EXPECT_EQ(slow.cuts, 1);
  EXPECT_EQ(quick.cuts + late.cuts, 0);
  b.reset();
  a.reset();
  EXPECT_TRUE(StallWatch::Call(watch, more, &group).admitted());
  const StallWatch::Call e(watch, more, &group);
  EXPECT_FALSE(StallWatch::Call(watch, more, &group).admitted()) << "all are too young to be called slow";
  EXPECT_EQ(late.cuts + next.cuts + more.cuts, 0);
  EXPECT_FALSE(group.cut_slowest(1e6));
  clock.advance(2);
  EXPECT_TRUE(group.cut_slowest(1e6));
}

TEST(WorkerKeys, OnlyTheirOwn) {
  const WorkerKeys keys, others;
  const WorkerId w1{"w1"}, w12{"w12"};
  EXPECT_EQ(keys.worker_of(keys.name_of(w1)), w1);
  EXPECT_EQ(WorkerKeys::shown(keys.name_of(w12)), w12);
  std::string altered = keys.name_of(w1);
  altered.back() = altered.back() == '0' ? '1' : '0';
  std::string of_another = keys.name_of(w1);
  of_another.insert(2, "2");
  for (const std::string& name : {std::string(), std::string("w1"), std::string("w1."), std::string("."),
                                  altered, of_another, keys.name_of(w1) + "0", others.name_of(w1)})
    EXPECT_THROW(keys.worker_of(name), UnknownWorker) << name;
}

TEST(AnswerMemory, ALargeOneComesAloneAndASmallOneWaitsForRoom) {
  int asked = 0;
  std::shared_ptr<const void> large, second;
  AnswerMemory memory(100, [&] {
    ++asked;
    large.reset();
  });
  large = memory.take(1000);
  second = memory.take(60);
  EXPECT_EQ(asked, 1);
  EXPECT_TRUE(memory.take(40));
  EXPECT_EQ(asked, 1) << "there was room";
  const auto copy = second;
  second.reset();
  EXPECT_THROW(memory.take(60), LimitReached) << "the copy holds it still";
}

}  // namespace
}  // namespace lightmill
