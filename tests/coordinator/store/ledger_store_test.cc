// All stores: races for a tile, tiles that are cut, partials that are kept and taken back.
#include <gtest/gtest.h>

#include "tests/coordinator/core/fake_worker.h"
#include "tests/coordinator/store/any_store.h"

namespace lightmill {
namespace {

using testing::StoreKind;

class LedgerStore : public ::testing::TestWithParam<StoreKind> {
 protected:
  void SetUp() override {
    if (!stores.usable()) GTEST_SKIP() << testing::kNoPostgres;
    reopen();
    job.id = JobId{"j1"};
    job.settings = testing::small_settings(96, 64, 10);
    store->add_job(job, "manifest", {});
    std::vector<TileRecord> tiles;
    for (int64_t i = 0; i < 3; ++i) {
      TileRecord tile;
      tile.id = TileId{i};
      tile.tile = {{0, 0, 3, 2}, i, i + 1};
      tiles.push_back(tile);
    }
    store->add_tiles(job.id, tiles);
  }
  void reopen() { store = &stores.reopen(); }
  TileRecord row(int64_t id) { return store->tiles(job.id).at(static_cast<size_t>(id)); }
  void commit(int64_t id, const std::string& partial) {
    TileRecord tile = row(id);
    tile.state = TileState::kLeased;
    tile.attempt = 1;
    tile.worker = WorkerId{"w1"};
    store->save_tile(job, tile);
    tile.state = TileState::kCommitted;
    tile.digest = partial;
    ASSERT_TRUE(store->commit_tile(job, tile, partial));
  }
  std::vector<std::string> spool() {
    std::vector<std::string> all;
    store->for_each_spooled(job.id, [&](const std::string& bytes) { all.push_back(bytes); });
    return all;
  }
  testing::AnyStore stores{GetParam()};
  JobStore* store = nullptr;
  JobRecord job;
};

TEST_P(LedgerStore, EitherOfTwoLeasesMayCommitAndNoOther) {
  TileRecord raced = row(0);
  raced.state = TileState::kLeased;
  raced.attempt = 3;
  raced.worker = WorkerId{"late"};
  raced.rival_attempt = 2;
  raced.rival_worker = WorkerId{"early"};
  const auto committed = [&](const LeaseToken& token, bool rival) {
    TileRecord tile = raced;
    tile.state = TileState::kCommitted;
    tile.digest = "d";
    tile.worker = rival ? WorkerId{} : token.worker;
    if (!rival) tile.attempt = token.attempt;
    tile.rival_attempt = rival ? token.attempt : 0;
    tile.rival_worker = rival ? token.worker : WorkerId{};
    return tile;
  };
  for (const bool rival : {false, true}) {
    store->save_tile(job, raced);
    reopen();
    EXPECT_EQ(row(0), raced);
    for (const LeaseToken& wrong : {LeaseToken{1, WorkerId{"early"}},
                                    {3, WorkerId{"early"}},
                                    {2, WorkerId{"late"}},
                                    {2, WorkerId{"x"}}}) {
      EXPECT_FALSE(store->commit_tile(job, committed(wrong, rival), "p"))
          << wrong.attempt << wrong.worker.value;
    }
    EXPECT_TRUE(spool().empty());
    const TileRecord good =
        committed(rival ? LeaseToken{2, WorkerId{"early"}} : LeaseToken{3, WorkerId{"late"}}, rival);
    EXPECT_TRUE(store->commit_tile(job, good, "p"));
    EXPECT_EQ(spool().size(), 1u);
    EXPECT_FALSE(store->commit_tile(
        job, committed(rival ? LeaseToken{3, WorkerId{"late"}} : LeaseToken{2, WorkerId{"early"}}, !rival),
        "q"))
        << "the second one";
    reopen();
    EXPECT_EQ(row(0), good);
    EXPECT_EQ(spool(), (std::vector<std::string>{"p"}));
    store->take_back(job, {raced}, {});
    EXPECT_TRUE(spool().empty());
  }
}

TEST_P(LedgerStore, OneRowIsReadAlone) {
  commit(1, "p");
  reopen();
  for (int64_t id = 0; id < 3; ++id) EXPECT_EQ(store->tile(job.id, TileId{id}), row(id));
  EXPECT_EQ(row(1).state, TileState::kCommitted);
  for (const int64_t id : {int64_t{-1}, int64_t{3}, std::numeric_limits<int64_t>::max()})
    EXPECT_EQ(store->tile(job.id, TileId{id}), std::nullopt) << id;
}

TEST_P(LedgerStore, ATileIsCutInOneStep) {
  TileRecord smaller = row(2), other = smaller;
  smaller.tile.cells = {0, 0, 1, 2};
  other.id = TileId{3};
  other.tile.cells = {1, 0, 3, 2};
  store->split_tile(job.id, smaller, {other});
  reopen();
  EXPECT_EQ(store->tiles(job.id).size(), 4u);
  EXPECT_EQ(row(2), smaller);
  EXPECT_EQ(row(3), other);
}

TEST_P(LedgerStore, KeptPartialsAreFoldedOnceUntilSomeAreTakenBack) {
  const std::string long_one(2500, 'a');
  commit(0, long_one);
  commit(1, "b");
  store->checkpoint(job.id, {"film", "batches"}, true);
  reopen();
  EXPECT_TRUE(spool().empty()) << "the snapshot has them";
  EXPECT_EQ(store->kept_partials(job.id), (std::vector{TileId{0}, TileId{1}}));
  commit(2, "c");
  reopen();
  EXPECT_EQ(spool(), (std::vector<std::string>{"c"}));

  TileRecord again = row(1);
  again.state = TileState::kPending;
  again.digest.clear();
  again.check = TileCheck::kNone;
  store->take_back(job, {again}, {});
  reopen();
  EXPECT_EQ(row(1), again);
  EXPECT_EQ(store->snapshot(job.id).film + store->snapshot(job.id).batches, "");
  EXPECT_EQ(spool(), (std::vector<std::string>{long_one, "c"})) << "in the order of the tiles";
  commit(1, "b2");
  EXPECT_EQ(spool().size(), 3u);
  store->checkpoint(job.id, {"film", "batches"}, true);
  EXPECT_TRUE(spool().empty());
  store->checkpoint(job.id, {"film", "batches"}, false);
  EXPECT_TRUE(store->kept_partials(job.id).empty());
  reopen();
  EXPECT_EQ(store->snapshot(job.id).film, "film");
}

TEST_P(LedgerStore, WhatIsLeftBecomesTheSnapshotWhenTilesAreTakenBack) {
  commit(0, "a");
  store->checkpoint(job.id, {"film", "batches"}, false);
  commit(1, "b");
  commit(2, "c");
  TileRecord again = row(2);
  again.state = TileState::kPending;
  again.digest.clear();
  store->take_back(job, {again}, {"film 2", "batches 2"});
  reopen();
  EXPECT_EQ(row(2), again);
  EXPECT_EQ(store->snapshot(job.id).film + store->snapshot(job.id).batches, "film 2batches 2");
  EXPECT_TRUE(spool().empty()) << "the new snapshot has it";
  commit(2, "c2");
  reopen();
  EXPECT_EQ(spool(), (std::vector<std::string>{"c2"}));
}

INSTANTIATE_TEST_SUITE_P(All, LedgerStore, testing::kAllStores, testing::store_name);

}  // namespace
}  // namespace lightmill
