#include "common/rpc/convert.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(Convert, JobStatusRoundTrip) {
  JobStatus s;
  s.id = JobId{"j7"};
  s.name = "name";
  s.state = JobState::kPaused;
  s.message = "why";
  s.settings.grid = {640, 480, {10, 20, 300, 400}};
  s.settings.spp = 123;
  s.settings.seed = 0xfedcba9876543210u;
  s.bundle_digest = "d";
  s.priority = -4;
  s.pool = "p";
  s.packets_done = 5;
  s.packets_total = 6;
  s.leases_reassigned = 2;
  s.commit_bytes = uint64_t{5} << 33;
  s.relmse = 0.5;
  s.boxes = {BoxError{0.5, 0.25, 1, 0.75}, BoxError{}, BoxError{2, {}, {}, {}}};
  s.counters.nonfinite = 3;
  s.counters.shadow_rays = 9;
  s.dropped[0] = {2, 0.25};
  s.dropped[3] = {uint64_t{1} << 40, std::nullopt};
  s.missing_light = {"a tenth", "and more"};
  s.version = 77;
  EXPECT_EQ(from_proto(to_proto(s)).turn_seconds, -1);
  s.waiting = "waits behind job j3";
  s.waits_behind = JobId{"j3"};
  s.turn_seconds = 0;
  const JobStatus back = from_proto(to_proto(s));
  EXPECT_EQ(back.id, s.id);
  EXPECT_EQ(back.state, s.state);
  EXPECT_EQ(settings_to_json(back.settings), settings_to_json(s.settings));
  EXPECT_EQ(back.settings.seed, s.settings.seed);
  EXPECT_EQ(back.priority, s.priority);
  EXPECT_EQ(back.packets_total, 6);
  EXPECT_EQ(back.relmse, s.relmse);
  EXPECT_EQ(back.relmse_low, std::nullopt);
  EXPECT_EQ(back.boxes, s.boxes);
  EXPECT_EQ(back.counters, s.counters);
  EXPECT_EQ(back.dropped, s.dropped);
  EXPECT_EQ(back.missing_light, s.missing_light);
  EXPECT_EQ(back.version, 77u);
  EXPECT_EQ(back.waiting, s.waiting);
  EXPECT_EQ(back.waits_behind, s.waits_behind);
  EXPECT_EQ(back.turn_seconds, 0);
}

TEST(Convert, KindsOfDroppedLightThatAreUnknownAreLeftOut) {
  JobStatus status;
  status.settings.grid = {64, 48, {0, 0, 64, 48}};
  v1::JobStatus m = to_proto(status);
  EXPECT_EQ(m.dropped_size(), 0) << "of nothing nothing is told";
  m.add_dropped()->set_kind(static_cast<v1::DropKind>(99));
  m.mutable_dropped(0)->set_count(5);
  EXPECT_EQ(from_proto(m).dropped, DroppedShares{});
}

TEST(Convert, EveryEnumValueRoundTrips) {
  for (JobState state : {JobState::kQueued, JobState::kRunning, JobState::kPaused, JobState::kDone,
                         JobState::kFailed, JobState::kCancelled}) {
    EXPECT_EQ(from_proto(to_proto(state)), state);
    EXPECT_EQ(job_state_from_name(job_state_name(state)), state);
  }
  for (CommitResult result : {CommitResult::kAccepted, CommitResult::kAlreadyCommitted, CommitResult::kStale,
                              CommitResult::kCorrupt, CommitResult::kUnknownJob}) {
    EXPECT_EQ(from_proto(to_proto(result)), result);
  }
  for (const char* state : {"idle", "rendering", "draining", "lost", "refused", "benched"}) {
    WorkerStatus worker;
    worker.state = state;
    EXPECT_EQ(from_proto(to_proto(worker)).state, state);
  }
  EXPECT_THROW(from_proto(v1::JOB_STATE_UNSPECIFIED), Error);
  EXPECT_THROW(from_proto(static_cast<v1::JobState>(99)), Error);
  EXPECT_EQ(job_state_from_name("nonsense"), std::nullopt);
}

TEST(Convert, LeaseGrantAndTileRoundTrip) {
  LeaseGrant grant;
  grant.job = JobId{"j1"};
  grant.tile_id = TileId{4};
  grant.attempt = 3;
  grant.tile = {{1, 2, 3, 4}, 16, 32};
  grant.settings.grid = {128, 128, {0, 0, 128, 128}};
  grant.bundle_digest = "d";
  const LeaseGrant back = from_proto(to_proto(grant));
  EXPECT_EQ(back.tile, grant.tile);
  EXPECT_EQ(back.attempt, 3);
  EXPECT_EQ(back.lease_seconds, grant.lease_seconds);
  const TileStatus tile{TileId{4}, grant.tile, "leased", 3, WorkerId{"w1"}, "d"};
  EXPECT_EQ(from_proto(to_proto(tile)).state, "leased");
}

TEST(Convert, ALeaseThatWasChangedOnItsWayHasAnotherDigest) {
  LeaseGrant grant;
  grant.job = JobId{"j1"};
  grant.attempt = 1;
  grant.tile = {{1, 2, 3, 4}, 16, 32};
  grant.settings.grid = {128, 128, {0, 0, 128, 128}};
  const v1::LeaseGrant message = to_proto(grant);
  EXPECT_EQ(message.digest(), grant_digest(message));
  v1::LeaseGrant changed = message;
  changed.mutable_tile()->set_sample_end(33);
  EXPECT_NE(message.digest(), grant_digest(changed));
  changed = message;
  changed.mutable_settings_json()->back() ^= 1;
  EXPECT_NE(message.digest(), grant_digest(changed));
}

TEST(Convert, APilotHasNoTile) {
  LeaseGrant grant;
  grant.job = JobId{"j1"};
  grant.tile_id = TileId{0};
  grant.attempt = 1;
  grant.settings.integrator = Integrator::kAuto;
  grant.settings.grid = {128, 128, {0, 0, 128, 128}};
  const v1::LeaseGrant message = to_proto(grant);
  EXPECT_TRUE(message.pilot());
  EXPECT_FALSE(message.has_tile());
  EXPECT_EQ(from_proto(message).tile, TileSpec());
  EXPECT_TRUE(needs_pilot(from_proto(message).settings));
  const TileStatus status{TileId{0}, {}, "leased", 1, WorkerId{"w1"}, ""};
  EXPECT_EQ(from_proto(to_proto(status)).tile, TileSpec());
  v1::LeaseGrant neither = message;
  neither.set_pilot(false);
  EXPECT_THROW(from_proto(neither), Error);
}

TEST(Convert, CurveRoundTrip) {
  ErrorCurve curve{"name", {}};
  ErrorPoint point;
  point.spp = 4;
  point.relmse_high = 2;
  point.true_flip = 0.5;
  point.batches = 17;
  point.boxes = {BoxError{}, BoxError{0.5, 0.25, 1, 0.75}, BoxError{{}, {}, {}, 2}};
  curve.points = {point, {}};
  const ErrorCurve back = from_proto(to_proto(curve));
  ASSERT_EQ(back.points.size(), 2u);
  EXPECT_EQ(back.points[0].relmse_high, 2);
  EXPECT_EQ(back.points[0].relmse, std::nullopt);
  EXPECT_EQ(back.points[0].true_flip, 0.5);
  EXPECT_EQ(back.points[0].batches, 17);
  EXPECT_EQ(back.points[0].boxes, point.boxes);
  EXPECT_EQ(back.points[1].boxes, BoxErrors());
}

TEST(Convert, BoxesOfStrangersAreTakenByTheirSides) {
  JobStatus status;
  status.settings.grid = {640, 480, {0, 0, 640, 480}};
  v1::JobStatus message = to_proto(status);
  EXPECT_EQ(message.boxes_size(), 0) << "what is unknown is not sent";
  for (const int side : {32, 4, 0, -4, 64, 2147483647}) {
    v1::BoxError& box = *message.add_boxes();
    box.set_side(side);
    box.set_relmse(side);
  }
  const BoxErrors expected = {BoxError{4, {}, {}, {}}, BoxError{}, BoxError{32, {}, {}, {}}};
  EXPECT_EQ(from_proto(message).boxes, expected);
  for (int i = 0; i < 1000; ++i) *message.add_boxes() = message.boxes(1);
  EXPECT_EQ(from_proto(message).boxes, expected) << "of many of a side one counts";
  EXPECT_EQ(to_proto(from_proto(message)).boxes_size(), 2);
}

TEST(Convert, OutOfRangeIsRefused) {
  v1::TileSpec tile;
  EXPECT_THROW(from_proto(tile), Error);
  tile.mutable_cells()->set_x1(1);
  tile.mutable_cells()->set_y1(1);
  tile.set_sample_end(1);
  EXPECT_NO_THROW(from_proto(tile));
  tile.set_sample_begin(-1);
  EXPECT_THROW(from_proto(tile), Error);
  v1::WorkerRegistration registration;
  EXPECT_THROW(from_proto(registration), Error) << "no threads";
  registration.set_threads(4);
  EXPECT_NO_THROW(from_proto(registration));
  registration.set_host(std::string(2000, 'x'));
  EXPECT_THROW(from_proto(registration), Error);
  EXPECT_THROW(from_proto(v1::LeaseKey()), Error);
}

}  // namespace
}  // namespace lightmill
