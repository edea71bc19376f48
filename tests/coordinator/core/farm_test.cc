// The farm as a state machine: leases, commits, and what fails. Time is simulated.
#include "coordinator/core/farm.h"

#include <tuple>

#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

using FarmTest = FarmFixture;

TEST_F(FarmTest, RendersAJobAndGivesItsImage) {
  for (Integrator integrator : {Integrator::kBdpt, Integrator::kPt, Integrator::kLt}) {
    const JobRequest request = small_job(100, 70, 40, integrator);
    const JobId job = farm.submit(request);
    EXPECT_EQ(farm.job(job).state, JobState::kQueued);
    const WorkerId worker = farm.register_worker(registration());
    EXPECT_GT(work(farm, worker), 10);
    const JobStatus status = farm.job(job);
    EXPECT_EQ(status.state, JobState::kDone);
    EXPECT_EQ(status.packets_done, status.packets_total);
    EXPECT_EQ(status.packets_total, 4 * 3 * block_count(40));
    EXPECT_EQ(status.spp, 40);
    EXPECT_EQ(status.leases_reassigned, 0);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
    for (const TileStatus& tile : farm.tiles(job)) {
      EXPECT_EQ(tile.state, "committed");
      EXPECT_EQ(tile.attempt, 1);
      EXPECT_EQ(tile.digest.size(), 64u);
    }
  }
}

TEST_F(FarmTest, TellsTheShareOfTheImageThatWasDropped) {
  const JobId job = farm.submit(small_job(64, 64, 4, Integrator::kPt));
  const Image image = fake_image(farm.job(job).settings);
  double mean = 0;
  for (const float x : image.data) mean += double{x} / static_cast<double>(image.data.size());
  const WorkerId worker = join();
  bool first = true;
  while (const auto grant = farm.lease(worker)) {
    Partial partial = fake_partial(grant->tile, grant->settings);
    const auto samples =
        static_cast<double>(partial.grid.pixels(grant->tile.cells).area() * grant->tile.samples());
    partial.dropped.of(DropKind::kCapped) = {10, samples * mean / 3};
    partial.dropped.of(DropKind::kNotFinite) = {2, samples / 8};
    partial.counters.nonfinite = 2;
    EXPECT_EQ(farm.commit(worker, key(*grant), encode_partial(partial)), CommitResult::kAccepted);
    const JobStatus status = farm.job(job);
    EXPECT_NEAR(status.dropped[0].share.value_or(0), 1.0 / 8, 1e-12);
    if (first && status.state != JobState::kDone) {
      EXPECT_EQ(status.dropped[3].share, std::nullopt);
    }
    first = false;
  }
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kDone);
  EXPECT_EQ(status.dropped[3].count, 10u * static_cast<uint64_t>(status.tiles_committed));
  EXPECT_NEAR(status.dropped[3].share.value_or(0), 0.25, 1e-6);
  EXPECT_EQ(status.dropped[0].count, status.counters.nonfinite);
  EXPECT_EQ(status.dropped[1], DroppedShare{});
}

TEST_F(FarmTest, AStoreNeedNotKeepLayersThatStayInMemory) {
  auto owned = std::make_unique<MemoryJobStore>(false);
  MemoryJobStore& store = *owned;
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 10e3;
  Farm alone(std::move(owned), clock, options);
  const JobRequest request = small_job(100, 70, 40);
  const JobId job = alone.submit(request);
  EXPECT_GT(work(alone, alone.register_worker(registration())), 10);
  EXPECT_EQ(alone.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(alone.image(job), fake_image(request.settings)));
  EXPECT_TRUE(store.kept_partials(job).empty());
  EXPECT_TRUE(store.snapshot(job).film.empty());
}

TEST_F(FarmTest, OddSizesAndSampleCounts) {
  const WorkerId worker = farm.register_worker(registration());
  for (const auto& [width, height, spp] : {std::tuple{1, 1, 1}, {1, 2000, 3}, {33, 31, 17}, {64, 64, 50}}) {
    const JobRequest request = small_job(width, height, spp);
    const JobId job = farm.submit(request);
    work(farm, worker);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings))) << width << "x" << height;
  }
  JobRequest cropped = small_job(300, 200, 20);
  cropped.settings.grid.crop = {45, 10, 201, 133};
  const JobId job = farm.submit(cropped);
  work(farm, worker);
  const Image image = farm.image(job);
  EXPECT_EQ(image.width, 201 - 45);
  EXPECT_TRUE(same_pixels(image, fake_image(cropped.settings)));
}

TEST_F(FarmTest, OrderOfCommitsDoesNotShow) {
  const JobRequest request = small_job(96, 96, 32);
  const JobId job = farm.submit(request);
  std::vector<WorkerId> workers;
  for (int i = 0; i < 3; ++i) workers.push_back(farm.register_worker(registration()));
  std::vector<std::pair<WorkerId, LeaseGrant>> held;
  for (int turn = 0;; ++turn) {
    const WorkerId& worker = workers[static_cast<size_t>(turn) % 3];
    if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    if (held.empty()) break;
    if (held.size() < 5 && turn % 7 != 0) continue;
    // The newest lease comes in first.
    EXPECT_EQ(commit(held.back().first, held.back().second), CommitResult::kAccepted);
    held.pop_back();
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(FarmTest, DuplicatesAndStaleAttemptsAreNotFolded) {
  const JobRequest request = small_job(64, 64, 4);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  const LeaseGrant first = farm.lease(ann).value();
  EXPECT_EQ(commit(ann, first), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, first), CommitResult::kAlreadyCommitted);
  EXPECT_EQ(commit(bob, first), CommitResult::kStale) << "not his lease";

  const LeaseGrant lost = farm.lease(ann).value();
  clock.advance(10.5);
  const LeaseGrant again = farm.lease(bob).value();
  EXPECT_EQ(again.tile_id, lost.tile_id);
  EXPECT_EQ(again.attempt, 2);
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(commit(bob, again), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(farm.job(job).leases_reassigned, 1);
  work(farm, bob);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
  EXPECT_EQ(commit(bob, again), CommitResult::kAlreadyCommitted) << "also once the job is done";
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(farm.commit(ann, {JobId{"j99"}, TileId{0}, 1}, "x"), CommitResult::kUnknownJob);
  EXPECT_EQ(farm.commit(ann, {job, TileId{99999}, 1}, "x"), CommitResult::kUnknownJob);
}

TEST_F(FarmTest, RenewKeepsALeaseAndNamesTheLost) {
  farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration());
  const LeaseGrant grant = farm.lease(ann).value();
  for (int i = 0; i < 5; ++i) {
    clock.advance(6);
    EXPECT_TRUE(farm.renew(ann, {key(grant)}).empty());
  }
  const LeaseKey wrong{grant.job, grant.tile_id, 7};
  EXPECT_EQ(farm.renew(ann, {key(grant), wrong}), (std::vector{wrong}));
  clock.advance(11);
  EXPECT_EQ(farm.renew(ann, {key(grant)}), (std::vector{key(grant)}));
  EXPECT_EQ(commit(ann, grant), CommitResult::kStale);
}

TEST_F(FarmTest, CorruptPartialsAreRefusedAndTheTileIsLeasedAgain) {
  const JobRequest request = small_job(64, 64, 4);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  const auto refused = [&](const std::function<std::string(const LeaseGrant&)>& bytes) {
    const WorkerId bob =
        farm.register_worker(registration());  // a new one each time: three such bench a worker
    const LeaseGrant grant = farm.lease(bob).value();
    EXPECT_EQ(farm.commit(bob, key(grant), bytes(grant)), CommitResult::kCorrupt);
    EXPECT_EQ(farm.commit(bob, key(grant), fake_bytes(grant)), CommitResult::kStale) << "the lease is gone";
  };
  EXPECT_EQ(commit(ann, farm.lease(ann).value()), CommitResult::kAccepted);
  refused([](const LeaseGrant&) { return std::string(); });
  refused([](const LeaseGrant& g) { return fake_bytes(g).substr(0, 50); });
  refused([](const LeaseGrant& g) {  // another tile's pixels
    TileSpec other = g.tile;
    other.sample_end += 1;
    return encode_partial(fake_partial(other, g.settings));
  });
  refused([](const LeaseGrant& g) {  // another film
    RenderSettings other = g.settings;
    other.grid = {65, 64, {0, 0, 65, 64}};
    return encode_partial(fake_partial(g.tile, other));
  });
  commit(ann, farm.lease(ann).value());  // a good one in between, or the job would fail
  refused([](const LeaseGrant& g) {      // another plan
    Partial p = fake_partial(g.tile, g.settings);
    p.quantum_exponent += 1;
    return encode_partial(p);
  });
  refused([](const LeaseGrant& g) {  // a layer is missing
    Partial p = fake_partial(g.tile, g.settings);
    p.camera.clear();
    return encode_partial(p);
  });
  EXPECT_EQ(farm.stats().commits_corrupt, 6u);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).leases_reassigned, 6);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(FarmTest, ATileThatKeepsFailingFailsTheJobWithTheEvidence) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration());
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(farm.job(job).state, i == 0 ? JobState::kQueued : JobState::kRunning);
    farm.fail(ann, key(farm.lease(ann).value()), "texture wood.png vanished");
  }
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kFailed);
  EXPECT_THAT(status.message, HasSubstr("tile 0"));
  EXPECT_THAT(status.message, HasSubstr("texture wood.png vanished"));
  EXPECT_FALSE(farm.lease(ann));
  farm.retry(job);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_EQ(farm.job(job).message, "");
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(farm.job(job).settings)));
}

TEST_F(FarmTest, AFailedTileGoesToAnotherWorkerIfThereIsOne) {
  farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  const LeaseGrant failed = farm.lease(ann).value();
  farm.fail(ann, key(failed), "no");
  EXPECT_NE(farm.lease(ann).value().tile_id, failed.tile_id);
  EXPECT_EQ(farm.lease(bob).value().tile_id, failed.tile_id);
}

TEST_F(FarmTest, AWorkerThatKeepsFailingIsBenchedAndForgiven) {
  for (int i = 0; i < 3; ++i) farm.submit(small_job(320, 320, 16));
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  for (int i = 0; i < 8; ++i) farm.fail(ann, key(farm.lease(ann).value()), "bad memory");
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(farm.workers()[0].state, "benched");
  EXPECT_TRUE(farm.lease(bob));
  clock.advance(31);
  EXPECT_TRUE(farm.lease(ann));
}

}  // namespace
}  // namespace lightmill
