// The end of a job: stragglers are raced, tiles are cut for those who idle; and every pixel stays what it is.
#include <algorithm>
#include <vector>

#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;

class RacesTest : public FarmFixture {
 protected:
  /// A job whose tiles are one cell each, all but one of them committed by `fast`; `slow` holds that one.
  void bring_to_its_last_tile() {
    job = farm.submit(request);
    straggler = farm.lease(slow).value();
    while (const auto grant = farm.lease(fast)) {
      ASSERT_EQ(commit(fast, *grant, 2), CommitResult::kAccepted);  // a second on its two threads
    }
    ASSERT_EQ(farm.job(job).state, JobState::kRunning);
  }
  void expect_done() {
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_EQ(farm.job(job).packets_done, farm.job(job).packets_total);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
    for (const WorkerStatus& worker : farm.workers()) EXPECT_NE(worker.state, "rendering") << worker.id.value;
  }
  const JobRequest request = small_job(64, 64, 1);
  const WorkerId slow = join(), fast = join();
  JobId job;
  LeaseGrant straggler;
};

TEST_F(RacesTest, AStragglerIsRacedOnceItIsLate) {
  bring_to_its_last_tile();
  EXPECT_FALSE(farm.lease(fast)) << "not late yet";
  clock.advance(1.8);
  EXPECT_FALSE(farm.lease(slow)) << "nobody races itself";
  const auto race = farm.lease(fast);
  ASSERT_TRUE(race);
  EXPECT_EQ(race->tile_id, straggler.tile_id);
  EXPECT_EQ(race->attempt, 2);
  EXPECT_FALSE(farm.lease(join())) << "two are enough";
  EXPECT_EQ(commit(fast, *race), CommitResult::kAccepted);
  expect_done();
  EXPECT_EQ(commit(slow, straggler), CommitResult::kStale);
  EXPECT_EQ(commit(fast, *race), CommitResult::kAlreadyCommitted);
  EXPECT_EQ(farm.renew(slow, {key(straggler)}).size(), 1u) << "so it stops rendering";
  EXPECT_EQ(farm.stats().commits_corrupt, 0u);
  EXPECT_EQ(farm.stats().races, 1u);
  EXPECT_EQ(farm.job(job).leases_reassigned, 1);
  expect_done();
}

TEST_F(RacesTest, WhoSharesItsProcessorsIsNotLateByTheirTime) {
  job = farm.submit(request);
  for (int i = 0; i < 2; ++i) {  // a second of processor time, in two seconds
    const LeaseGrant grant = farm.lease(slow).value();
    clock.advance(2);
    ASSERT_EQ(commit(slow, grant, 2), CommitResult::kAccepted);
  }
  straggler = farm.lease(slow).value();
  while (const auto grant = farm.lease(fast)) ASSERT_EQ(commit(fast, *grant, 2), CommitResult::kAccepted);
  clock.advance(2.9);
  EXPECT_FALSE(farm.lease(fast)) << "in 3.25 s it is";
  clock.advance(0.5);
  EXPECT_TRUE(farm.lease(fast));
}

TEST_F(RacesTest, TheFirstMayWinItAfterAll) {
  bring_to_its_last_tile();
  clock.advance(2);
  const LeaseGrant race = farm.lease(fast).value();
  EXPECT_TRUE(farm.renew(slow, {key(straggler)}).empty());
  EXPECT_TRUE(farm.renew(fast, {key(race)}).empty());
  EXPECT_EQ(commit(slow, straggler), CommitResult::kAccepted);
  EXPECT_EQ(commit(fast, race), CommitResult::kStale);
  EXPECT_EQ(commit(slow, straggler), CommitResult::kAlreadyCommitted);
  EXPECT_EQ(farm.tiles(job)[static_cast<size_t>(straggler.tile_id.value)].attempt, 1)
      << "the one that counted";
  EXPECT_EQ(farm.tiles(job)[static_cast<size_t>(straggler.tile_id.value)].worker, slow);
  expect_done();
}

TEST_F(RacesTest, WhoDropsOutLeavesTheOther) {
  bring_to_its_last_tile();
  clock.advance(2);
  LeaseGrant race = farm.lease(fast).value();
  farm.fail(fast, key(race), "no memory");
  EXPECT_EQ(commit(fast, race), CommitResult::kStale);
  EXPECT_TRUE(farm.renew(slow, {key(straggler)}).empty());
  EXPECT_FALSE(farm.lease(fast)) << "it failed this one";
  const WorkerId third = join();
  race = farm.lease(third).value();
  EXPECT_EQ(race.attempt, 3);
  clock.advance(7.9);
  farm.renew(third, {key(race)});
  clock.advance(3);  // the first one's lease runs out
  EXPECT_EQ(farm.renew(slow, {key(straggler)}).size(), 1u);
  EXPECT_EQ(commit(slow, straggler), CommitResult::kStale);
  EXPECT_EQ(commit(third, race), CommitResult::kAccepted);
  expect_done();
}

TEST_F(RacesTest, BothMayDropOut) {
  bring_to_its_last_tile();
  clock.advance(2);
  const LeaseGrant race = farm.lease(fast).value();
  clock.advance(11);
  const WorkerId third = join();
  const LeaseGrant again = farm.lease(third).value();
  EXPECT_EQ(again.tile_id, straggler.tile_id);
  EXPECT_EQ(again.attempt, 3);
  EXPECT_EQ(commit(slow, straggler), CommitResult::kStale);
  EXPECT_EQ(commit(fast, race), CommitResult::kStale);
  EXPECT_EQ(commit(third, again), CommitResult::kAccepted);
  expect_done();
}

TEST_F(RacesTest, ACorruptRacerHarmsNobody) {
  bring_to_its_last_tile();
  clock.advance(2);
  const LeaseGrant race = farm.lease(fast).value();
  EXPECT_EQ(farm.commit(fast, key(race), "rubbish"), CommitResult::kCorrupt);
  EXPECT_EQ(commit(slow, straggler), CommitResult::kAccepted);
  expect_done();
}

TEST_F(RacesTest, CancelAndPauseEndBoth) {
  bring_to_its_last_tile();
  clock.advance(2);
  const LeaseGrant race = farm.lease(fast).value();
  farm.cancel(job);
  EXPECT_EQ(commit(fast, race), CommitResult::kUnknownJob);
  for (const WorkerStatus& worker : farm.workers()) EXPECT_EQ(worker.state, "idle");
  farm.retry(job);
  work(farm, fast);
  expect_done();
}

TEST_F(RacesTest, NobodyRacesWhileThereIsOtherWork) {
  bring_to_its_last_tile();
  clock.advance(5);
  const JobId other = farm.submit(small_job(32, 32, 1));
  EXPECT_EQ(farm.lease(fast).value().job, other);
}

TEST_F(RacesTest, PendingTilesAreCutForThoseWhoIdle) {
  JobRequest wide = small_job(256, 256, 6, Integrator::kPt);  // 64 cells
  const JobId id = farm.submit(wide);
  // One worker is there when the last round is opened: it has few tiles.
  while (farm.job(id).spp < 4) commit(fast, farm.lease(fast).value(), 2);
  const LeaseGrant last = farm.lease(fast).value();
  std::vector<WorkerId> crowd;
  for (int i = 0; i < 20; ++i) crowd.push_back(join());
  const size_t before = farm.tiles(id).size();
  std::vector<std::pair<WorkerId, LeaseGrant>> held;
  for (const WorkerId& worker : crowd) {
    if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
  }
  EXPECT_EQ(held.size(), crowd.size()) << "nobody idles";
  EXPECT_GT(farm.tiles(id).size(), before);
  EXPECT_GT(farm.stats().tiles_split, 0u);
  EXPECT_EQ(commit(fast, last), CommitResult::kAccepted);
  for (const auto& [worker, grant] : held) EXPECT_EQ(commit(worker, grant), CommitResult::kAccepted);
  for (int turn = 0; turn < 100 && farm.job(id).state != JobState::kDone; ++turn) work(farm, crowd[0], 1);
  EXPECT_EQ(farm.job(id).state, JobState::kDone);
  EXPECT_EQ(farm.job(id).packets_done, farm.job(id).packets_total);
  EXPECT_TRUE(same_pixels(farm.image(id), fake_image(wide.settings)));
  const uint64_t split = farm.stats().tiles_split;
  farm.extend(id, 40, {}, {});
  work(farm, crowd[0]);
  EXPECT_EQ(farm.job(id).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(id), fake_image(farm.job(id).settings))) << split;
}

TEST_F(RacesTest, TheLastPendingTileIsCutSoThatAllEndTogether) {
  const JobRequest wide = small_job(256, 256, 16, Integrator::kBdpt);  // few tiles, as splats are heavy
  const JobId id = farm.submit(wide);
  // Two workers of 65536 samples a second each.
  const WorkerId other = join();
  const auto seconds = [&](const LeaseGrant& grant) {
    return static_cast<double>(wide.settings.grid.pixels(grant.tile.cells).area() * grant.tile.samples()) /
           65536;
  };
  std::map<WorkerId, std::pair<LeaseGrant, double>> held;  // and when they will have it
  std::map<WorkerId, double> idle_since;
  double now = 0;
  for (const WorkerId& worker : {fast, other}) {
    const auto grant = farm.lease(worker);
    ASSERT_TRUE(grant);
    held.insert({worker, {*grant, seconds(*grant)}});
  }
  while (!held.empty()) {
    const auto next = std::min_element(held.begin(), held.end(), [](const auto& a, const auto& b) {
      return a.second.second < b.second.second;
    });
    const auto [worker, tile] = *next;
    held.erase(next);
    clock.advance(tile.second - now);
    now = tile.second;
    EXPECT_EQ(commit(worker, tile.first, 2 * seconds(tile.first)), CommitResult::kAccepted);
    if (const auto grant = farm.lease(worker)) {
      held.insert({worker, {*grant, now + seconds(*grant)}});
    } else {
      idle_since[worker] = now;
    }
  }
  EXPECT_EQ(farm.job(id).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(id), fake_image(wide.settings)));
  ASSERT_EQ(idle_since.size(), 2u);
  EXPECT_LT(now - std::min(idle_since[fast], idle_since[other]), 0.35) << "of " << now;
  EXPECT_LT(farm.job(id).tiles_committed, 16);
}

}  // namespace
}  // namespace lightmill
