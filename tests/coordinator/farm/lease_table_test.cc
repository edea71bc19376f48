#include "coordinator/farm/lease_table.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <vector>

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
  table.apply(table.committed(id, table.find(id)->attempt, "digest"));
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
  ASSERT_EQ(table.expired(10).size(), 1u);
  EXPECT_EQ(table.expired(10)[0].tile, TileId{0});
  table.apply(table.released(TileId{0}, 1, false));
  EXPECT_FALSE(table.holds(TileId{0}, kAnn, 1));
  EXPECT_EQ(*table.next_pending(any), TileId{0});
  lease(table, TileId{0}, kBob, 20);
  EXPECT_TRUE(table.holds(TileId{0}, kBob, 2));
}

TEST(LeaseTable, RenewMovesTheExpiryAndAPinStopsIt) {
  LeaseTable table;
  table.add(round(0, 1, 0, 1));
  lease(table, TileId{0}, kAnn, 10);
  table.renew(TileId{0}, 1, 15);
  EXPECT_TRUE(table.expired(14).empty());
  table.pin(TileId{0}, 1);
  table.pin(TileId{0}, 1);
  table.renew(TileId{0}, 1, 16);
  table.unpin(TileId{0}, 1);
  EXPECT_TRUE(table.expired(1e9).empty()) << "another call with the same commit goes on";
  table.unpin(TileId{0}, 1);
  EXPECT_TRUE(table.expired(15).empty());
  EXPECT_EQ(table.expired(16).size(), 1u);
}

TEST(LeaseTable, ExpiresWhatALookAtEveryLeaseFinds) {
  constexpr int kTiles = 150;
  LeaseTable table;
  table.add(round(0, kTiles, 0, 1));
  std::mt19937 random(7);
  double now = 0;
  size_t found = 0;
  for (int step = 0; step < 20000; ++step) {
    now += 0.001 * static_cast<double>(random() % 20);
    const TileId id{static_cast<int64_t>(random() % kTiles)};
    const TileRecord tile = *table.find(id);
    const double expires = now + 0.1 * static_cast<double>(random() % 30);
    switch (tile.state == TileState::kLeased ? random() % 6 : 0) {
      case 0:
        if (tile.state == TileState::kPending) lease(table, id, kAnn, expires);
        break;
      case 1:
        table.apply(table.released(id, tile.attempt, false));
        break;
      case 2:
        table.pin(id, tile.attempt);
        break;
      case 3:
        table.unpin(id, tile.attempt);
        break;
      default:
        table.renew(id, tile.attempt, expires);  // later or earlier
    }
    std::vector<TileId> over, expected;
    for (const LeaseTable::Lease& l : table.leases()) {
      if (l.pins == 0 && l.expires <= now) expected.push_back(l.tile);
    }
    for (const LeaseTable::Lease& l : table.expired(now)) over.push_back(l.tile);
    ASSERT_EQ(over, expected) << step;
    found += over.size();
  }
  EXPECT_GT(found, 1000u);
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
    table.apply(table.released(TileId{0}, i, true));
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
  ASSERT_EQ(table.expired(10).size(), 1u);
  EXPECT_EQ(table.expired(10)[0].tile, TileId{0});
  table.apply(table.released(TileId{0}, 1, false));
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

TEST(LeaseTable, TwoMayRaceAndWhoeverEndsFirstLeavesTheOther) {
  const auto raced = [] {
    LeaseTable table;
    table.add(round(0, 1, 0, 1));
    lease(table, TileId{0}, kAnn, 10);
    lease(table, TileId{0}, kBob, 12);
    return table;
  };
  LeaseTable table = raced();
  EXPECT_TRUE(table.holds(TileId{0}, kAnn, 1) && table.holds(TileId{0}, kBob, 2));
  EXPECT_FALSE(table.holds(TileId{0}, kAnn, 2) || table.holds(TileId{0}, kBob, 1));
  EXPECT_EQ(table.leased_count(), 1);
  EXPECT_EQ(table.workers(), 2);
  LeaseTable three = raced();
  lease(three, TileId{0}, WorkerId{"w3"}, 14);  // a third one, of which the store knows as of the newest two
  EXPECT_TRUE(three.holds(TileId{0}, kAnn, 1) && three.holds(TileId{0}, WorkerId{"w3"}, 3));
  EXPECT_EQ(three.find(TileId{0})->rival_worker, kBob);
  EXPECT_EQ(three.with_stored(TileId{0}, 1).rival_worker, kAnn);
  EXPECT_EQ(three.with_stored(TileId{0}, 1).others, (std::vector{LeaseToken{2, kBob}}));
  EXPECT_EQ(three.with_stored(TileId{0}, 3), *three.find(TileId{0}));

  for (const int64_t winner : {1, 2}) {
    LeaseTable won = raced();
    won.apply(won.committed(TileId{0}, winner, "d"));
    EXPECT_EQ(won.leases().size(), 0u);
    EXPECT_EQ(won.leased_count() + won.workers(), 0);
    EXPECT_TRUE(committed_under(*won.find(TileId{0}), {winner, winner == 1 ? kAnn : kBob}));
    EXPECT_FALSE(committed_under(*won.find(TileId{0}), {3 - winner, winner == 1 ? kBob : kAnn}));
    EXPECT_EQ(won.complete_samples(), 1);
  }

  // The later one goes: the earlier one stays, keeps its expiry, and a third may come.
  table.apply(table.released(TileId{0}, 2, true));
  EXPECT_TRUE(table.holds(TileId{0}, kAnn, 1));
  EXPECT_FALSE(table.holds(TileId{0}, kBob, 2));
  EXPECT_EQ(table.expired(11).size(), 1u);
  lease(table, TileId{0}, WorkerId{"w3"}, 20);
  EXPECT_TRUE(table.holds(TileId{0}, WorkerId{"w3"}, 3));
  EXPECT_TRUE(table.holds(TileId{0}, kAnn, 1));
  // The earlier one goes, then the last.
  table.apply(table.released(TileId{0}, 1, false));
  EXPECT_EQ(table.leases().size(), 1u);
  table.apply(table.released(TileId{0}, 3, false));
  EXPECT_EQ(table.find(TileId{0})->state, TileState::kPending);
  EXPECT_EQ(table.find(TileId{0})->attempt, 3);
  EXPECT_EQ(*table.next_pending(any), TileId{0});
  EXPECT_EQ(table.workers(), 0);
}

TEST(LeaseTable, TilesOfTheLastRoundCanBeSplit) {
  LeaseTable table;
  table.add(round(0, 2, 0, 1));
  table.add(round(2, 1, 1, 2));
  TileRecord wide;
  wide.id = TileId{3};
  wide.tile = {{1, 0, 5, 1}, 1, 2};
  table.add({wide});
  EXPECT_FALSE(table.may_split(TileId{0})) << "an earlier round";
  EXPECT_FALSE(table.may_split(TileId{2})) << "a single cell";
  ASSERT_TRUE(table.may_split(TileId{3}));
  table.apply(table.split(TileId{3}, {{1, 0, 2, 1}, {2, 0, 4, 1}, {4, 0, 5, 1}}));
  ASSERT_EQ(table.tiles().size(), 6u);
  EXPECT_EQ(table.find(TileId{3})->tile.cells.count() + table.find(TileId{4})->tile.cells.count() +
                table.find(TileId{5})->tile.cells.count(),
            4);
  EXPECT_EQ(table.rounds().back().tiles, 4);
  for (int64_t id : {0, 1, 2, 3, 4}) lease(table, TileId{id}, kAnn, 10), commit(table, TileId{id});
  EXPECT_EQ(table.complete_samples(), 1) << "a part is missing";
  lease(table, TileId{5}, kAnn, 10), commit(table, TileId{5});
  EXPECT_EQ(table.complete_samples(), 2);
}

TEST(LeaseTable, ForgetsTilesOfRoundsThatAreOver) {
  LeaseTable table;
  for (int64_t r = 0; r < 5; ++r) table.add(round(10 * r, 10, r, r + 1));
  const auto finish = [&](int64_t first, int64_t end) {
    for (int64_t id = first; id < end; ++id) {
      lease(table, TileId{id}, kAnn, 10);
      commit(table, TileId{id});
    }
  };
  finish(0, 10);
  finish(11, 40);  // tile 10 is late
  table.forget(0);
  EXPECT_EQ(table.forgotten(), 0) << "the only complete round is the last one";
  lease(table, TileId{10}, kAnn, 10);
  table.forget(0);
  EXPECT_EQ(table.forgotten(), 0);
  commit(table, TileId{10});
  EXPECT_EQ(table.complete_samples(), 4);
  table.forget(35);
  EXPECT_EQ(table.forgotten(), 15) << "no more than what was asked for";
  table.forget(0);
  EXPECT_EQ(table.forgotten(), 30) << "the last complete round stays";
  EXPECT_EQ(table.find(TileId{29}), nullptr);
  ASSERT_NE(table.find(TileId{30}), nullptr);
  EXPECT_EQ(table.find(TileId{30})->id, TileId{30});
  EXPECT_EQ(table.tiles().front().id, TileId{30});
  EXPECT_EQ(table.next_id(), 50);
  EXPECT_EQ(table.complete_samples(), 4);
  EXPECT_EQ(table.planned_samples(), 5);
  EXPECT_EQ(table.pending_count(), 10);
  std::vector<TileRecord> wide = round(50, 1, 5, 6);
  wide[0].tile.cells = {0, 0, 2, 1};
  table.add(wide);
  table.apply(table.split(TileId{50}, {{0, 0, 1, 1}, {1, 0, 2, 1}}));
  EXPECT_EQ(table.next_id(), 52);
  finish(40, 52);
  EXPECT_EQ(table.complete_samples(), 6);
  EXPECT_FALSE(table.next_pending(any));
}

TEST(LeaseTable, ARoundOfWhichATileIsTakenBackIsNotOver) {
  LeaseTable table;
  for (int64_t r = 0; r < 3; ++r) table.add(round(2 * r, 2, r, r + 1));
  for (int64_t id = 0; id < 6; ++id) {
    lease(table, TileId{id}, kAnn, 10);
    commit(table, TileId{id});
  }
  EXPECT_EQ(table.complete_samples(), 3);
  TileRecord again = *table.find(TileId{2});
  again.state = TileState::kPending;
  table.apply(again);
  EXPECT_EQ(table.complete_samples(), 1);
  table.forget(0);
  EXPECT_EQ(table.forgotten(), 0) << "round 0 is the last complete one";
  lease(table, TileId{2}, kBob, 10);
  commit(table, TileId{2});
  EXPECT_EQ(table.complete_samples(), 3);
}

}  // namespace
}  // namespace lightmill
