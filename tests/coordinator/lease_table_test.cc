#include "coordinator/lease_table.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

const WorkerId kAnn{"w1"}, kBob{"w2"};
bool any(const TileRecord&) { return true; }

std::vector<TileRecord> round(int64_t first_id, int count, int64_t begin, int64_t end) {
  std::vector<TileRecord> tiles;
  for (int i = 0; i < count; ++i) {
    TileRecord tile;
    tile.id = TileId{first_id + i};
    tile.tile = {{i, 0, i + 1, 1}, begin, end};
    tiles.push_back(tile);
  }
  return tiles;
}

void lease(LeaseTable& table, TileId id, const WorkerId& worker, double expires) {
  table.apply(table.leased_to(id, worker), expires);
}
void commit(LeaseTable& table, TileId id) {
  TileRecord record = *table.find(id);
  record.state = TileState::kCommitted;
  table.apply(record);
}

TEST(LeaseTable, LeasesInOrderAndExpires) {
  LeaseTable table;
  table.add(round(0, 3, 0, 1));
  lease(table, *table.next_pending(any), kAnn, 10);
  EXPECT_EQ(*table.next_pending(any), TileId{1});
  EXPECT_TRUE(table.holds(TileId{0}, kAnn, 1));
  EXPECT_FALSE(table.holds(TileId{0}, kBob, 1));
  EXPECT_FALSE(table.holds(TileId{0}, kAnn, 2));
  EXPECT_TRUE(table.expired(9.9).empty());
  EXPECT_EQ(table.expired(10), (std::vector{TileId{0}}));
  table.apply(table.released(TileId{0}, false));
  EXPECT_FALSE(table.holds(TileId{0}, kAnn, 1));
  EXPECT_EQ(*table.next_pending(any), TileId{0});
  lease(table, TileId{0}, kBob, 20);
  EXPECT_TRUE(table.holds(TileId{0}, kBob, 2));
}

TEST(LeaseTable, RenewMovesTheExpiryAndAPinStopsIt) {
  LeaseTable table;
  table.add(round(0, 1, 0, 1));
  lease(table, TileId{0}, kAnn, 10);
  table.renew(TileId{0}, 15);
  EXPECT_TRUE(table.expired(14).empty());
  table.pin(TileId{0});
  table.pin(TileId{0});
  table.renew(TileId{0}, 16);
  table.unpin(TileId{0});
  EXPECT_TRUE(table.expired(1e9).empty()) << "another call with the same commit goes on";
  table.unpin(TileId{0});
  EXPECT_TRUE(table.expired(15).empty());
  EXPECT_EQ(table.expired(16).size(), 1u);
}

TEST(LeaseTable, CompleteSamplesIsTheCommittedPrefixOfRounds) {
  LeaseTable table;
  table.add(round(0, 2, 0, 1));
  table.add(round(2, 2, 1, 2));
  EXPECT_EQ(table.planned_samples(), 2);
  for (int id : {2, 3, 0}) {
    lease(table, TileId{id}, kAnn, 10);
    commit(table, TileId{id});
    EXPECT_EQ(table.complete_samples(), 0);
  }
  lease(table, TileId{1}, kAnn, 10);
  commit(table, TileId{1});
  EXPECT_EQ(table.complete_samples(), 2);
  EXPECT_FALSE(table.has_pending());
  EXPECT_EQ(table.leased_count(), 0);
}

TEST(LeaseTable, FailuresAndAttemptsCountUp) {
  LeaseTable table;
  table.add(round(0, 1, 0, 1));
  for (int i = 1; i <= 3; ++i) {
    lease(table, TileId{0}, kAnn, 10);
    table.apply(table.released(TileId{0}, true));
    EXPECT_EQ(table.find(TileId{0})->attempt, i);
    EXPECT_EQ(table.find(TileId{0})->failures, i);
  }
}

TEST(LeaseTable, KnowsNoTileBeyondItsOwn) {
  LeaseTable table;
  table.add(round(0, 1, 0, 1));
  EXPECT_EQ(table.find(TileId{-1}), nullptr);
  EXPECT_EQ(table.find(TileId{1}), nullptr);
  EXPECT_FALSE(table.holds(TileId{99}, kAnn, 1));
}

TEST(LeaseTable, ThePilotIsLeasedLikeATileButBelongsToNoRound) {
  LeaseTable table;
  TileRecord pilot;
  pilot.id = TileId{0};
  table.add({pilot});
  EXPECT_TRUE(table.rounds().empty());
  EXPECT_EQ(table.planned_samples(), 0);
  lease(table, *table.next_pending(any), kAnn, 10);
  EXPECT_EQ(table.expired(10), (std::vector{TileId{0}}));
  table.apply(table.released(TileId{0}, false));
  lease(table, *table.next_pending(any), kBob, 20);
  EXPECT_TRUE(table.holds(TileId{0}, kBob, 2));
  commit(table, TileId{0});
  EXPECT_EQ(table.complete_samples(), 0);
  table.add(round(1, 2, 0, 1));
  ASSERT_EQ(table.rounds().size(), 1u);
  EXPECT_EQ(table.rounds()[0].tiles, 2);
  for (int64_t id : {1, 2}) lease(table, TileId{id}, kAnn, 30), commit(table, TileId{id});
  EXPECT_EQ(table.complete_samples(), 1);
}

}  // namespace
}  // namespace lightmill
