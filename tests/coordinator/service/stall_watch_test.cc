// Calls of peers that are silent while it is their turn are cut off; those of slow ones are not.
#include "coordinator/service/stall_watch.h"

#include <gtest/gtest.h>

#include <memory>

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

}  // namespace
}  // namespace lightmill
