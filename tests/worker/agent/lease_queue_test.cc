#include "worker/agent/lease_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>
#include <tuple>

#include "common/base/error.h"
#include "tests/worker/agent/fake_farm.h"

namespace lightmill::agent {
namespace {

using testing::CountingRenderer;

std::shared_ptr<ActiveLease> make_lease(int64_t tile, const TileSpec& spec) {
  return std::make_shared<ActiveLease>(LeaseGrant{JobId{"j1"}, TileId{tile}, 1, spec, {}, "d", 10},
                                       std::make_shared<CountingRenderer>());
}

TEST(PacketList, CoversEverySampleOfEveryCellOnceAndKeepsBlocksApart) {
  const TileSpec tile{{1, 0, 3, 2}, 3, 41};
  const PacketList packets(tile);
  std::set<std::tuple<int, int, int64_t>> seen;
  for (int64_t i = 0; i < packets.size(); ++i) {
    const Packet packet = packets[i];
    EXPECT_EQ(block_of_sample(packet.sample_begin), block_of_sample(packet.sample_end - 1));
    EXPECT_LT(packet.sample_begin, packet.sample_end);
    for (int64_t s = packet.sample_begin; s < packet.sample_end; ++s) {
      EXPECT_TRUE(seen.insert({packet.cell_x, packet.cell_y, s}).second);
    }
  }
  EXPECT_EQ(seen.size(), 4u * 38u);
  for (const auto& [x, y, s] : seen) {
    EXPECT_TRUE(x >= 1 && x < 3 && y >= 0 && y < 2 && s >= 3 && s < 41);
  }
}

TEST(LeaseQueue, FinishesALeaseWhenItsLastPacketIsDone) {
  LeaseQueue queue(2);
  const auto lease = make_lease(0, {{0, 0, 2, 1}, 0, 1});
  queue.hold(key_of(lease->lease));
  queue.start(lease);
  const auto first = queue.take(), second = queue.take();
  queue.finish(*first);
  queue.finish(*second);
  const auto finished = queue.take_finished();
  ASSERT_TRUE(finished);
  EXPECT_EQ(finished->lease, lease);
  EXPECT_TRUE(finished->failure.text.empty());
  EXPECT_TRUE(queue.is_held(key_of(lease->lease)));  // until committed
}

TEST(LeaseQueue, AFailedPacketEndsItsLeaseWithTheReason) {
  LeaseQueue queue(1);
  const auto lease = make_lease(0, {{0, 0, 3, 2}, 0, 1});
  queue.hold(key_of(lease->lease));
  queue.start(lease);
  queue.finish(*queue.take(), {"broken"});
  const auto finished = queue.take_finished();
  ASSERT_TRUE(finished);
  EXPECT_EQ(finished->failure.text, "broken");
}

TEST(LeaseQueue, ALostLeaseIsNoLongerHandedOutNorCommitted) {
  LeaseQueue queue(1);
  const auto lost = make_lease(0, {{0, 0, 3, 1}, 0, 1}), kept = make_lease(1, {{0, 0, 1, 1}, 0, 1});
  for (const auto& lease : {lost, kept}) {
    queue.hold(key_of(lease->lease));
    queue.start(lease);
  }
  const auto of_lost = queue.take();
  EXPECT_EQ(of_lost->lease, lost);
  queue.lose({key_of(lost->lease)});
  const auto of_kept = queue.take();
  EXPECT_EQ(of_kept->lease, kept);
  queue.finish(*of_lost);
  queue.finish(*of_kept);
  EXPECT_EQ(queue.take_finished()->lease, kept);
  EXPECT_EQ(queue.held().size(), 1u);
}

TEST(LeaseQueue, ALeaseLostWhileLoadingNeverStarts) {
  LeaseQueue queue(1);
  const auto lost = make_lease(0, {{0, 0, 1, 1}, 0, 1}), kept = make_lease(1, {{0, 0, 1, 1}, 0, 1});
  queue.hold(key_of(lost->lease));
  queue.lose({key_of(lost->lease)});
  queue.start(lost);
  queue.hold(key_of(kept->lease));
  queue.start(kept);
  EXPECT_EQ(queue.take()->lease, kept);
}

TEST(LeaseQueue, AsksForMoreOnlyWhenTheEndIsNear) {
  LeaseQueue queue(1);
  std::atomic<int> rooms{0};
  queue.set_lead(0.5);
  const auto lease = make_lease(0, {{0, 0, 3, 2}, 0, 4096});  // 6 cells of 261 blocks
  queue.hold(key_of(lease->lease));
  queue.start(lease);
  std::thread asker([&] {
    while (queue.wait_for_room()) {
      ++rooms;
      queue.stop_growing();
    }
  });
  // A packet of 16 samples takes 10 ms and more: the tile takes 15 s.
  for (int i = 0; i < 20; ++i) {
    const auto work = queue.take();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    queue.finish(*work);
  }
  EXPECT_EQ(rooms, 0) << "another worker may have the next tile sooner";
  queue.set_lead(1e6);
  queue.finish(*queue.take());
  asker.join();
  EXPECT_EQ(rooms, 1);
}

TEST(LeaseQueue, CloseWakesEveryone) {
  LeaseQueue queue(1);
  queue.close();
  EXPECT_FALSE(queue.take());
  EXPECT_FALSE(queue.take_finished());
  EXPECT_FALSE(queue.wait_for_room());
}

}  // namespace
}  // namespace lightmill::agent
