// Scene files that the coordinator has lost: jobs say so, workers hear of it, and who has one brings it.
#include "coordinator/service/wanted_blobs.h"

#include <gmock/gmock.h>

#include "coordinator/service/worker_keys.h"
#include "tests/coordinator/service/service_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class WantedBlobsTest : public ServiceTest {
 protected:
  WantedBlobsTest() : job{submit(4)} {}
  void lose() { std::filesystem::remove(folder.file("blobs/" + digest)); }
  std::vector<std::string> told_with_a_lease(const std::string& id) {
    v1::LeaseRequest request;
    request.set_worker_id(id);
    v1::LeaseResponse response;
    EXPECT_TRUE(call(*worker, &v1::WorkerService::Stub::Lease, request, &response).ok());
    if (response.has_grant()) grant = from_proto(response.grant());
    return {response.wanted_blobs().begin(), response.wanted_blobs().end()};
  }
  /// A worker finds out that a file is not there.
  void hand_back(const std::string& id) {
    v1::FailRequest request;
    request.set_worker_id(id);
    *request.mutable_key() = to_proto(LeaseKey{grant.job, grant.tile_id, grant.attempt});
    request.set_handed_back(true);
    request.set_missing_blob(true);
    v1::FailResponse response;
    EXPECT_TRUE(call(*worker, &v1::WorkerService::Stub::Fail, request, &response).ok());
  }
  grpc::Status hand_in(const std::string& name, uint64_t size, const std::string& content) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    v1::HandInBlobResponse response;
    const auto writer = worker->HandInBlob(&context, &response);
    v1::HandInBlobRequest message;
    message.mutable_header()->set_worker_id(bringer);
    message.mutable_header()->set_digest(name);
    message.mutable_header()->set_size(size);
    writer->Write(message);
    for (const char byte : content) {
      message.set_chunk(std::string(1, byte));
      if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }

  const std::string digest = sha256_hex("scene");
  const JobId job;
  std::string bringer = register_worker();
  LeaseGrant grant;
};

TEST_F(WantedBlobsTest, NothingIsWantedWhileAllIsThere) {
  wanted.look_around();
  EXPECT_THAT(wanted.named(), IsEmpty());
  EXPECT_EQ(farm.job(job).state, JobState::kQueued);
  EXPECT_EQ(hand_in(digest, 5, "scene").error_code(), grpc::StatusCode::ABORTED) << "nobody asked";
}

TEST_F(WantedBlobsTest, AJobGoesOnWithThoseThatHaveTheFileAndSaysWhatIsLost) {
  const std::string id = register_worker();
  lose();
  wanted.look_around();
  EXPECT_THAT(told_with_a_lease(id), ElementsAre(digest));
  EXPECT_FALSE(grant.job.value.empty()) << "its worker may have the scene in memory";
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kRunning);
  EXPECT_THAT(status.message, AllOf(HasSubstr("file scene.pbrt (blob " + digest.substr(0, 12)),
                                    HasSubstr("lost on the coordinator; submit the scene again")));
}

TEST_F(WantedBlobsTest, AfterAnAskInVainTheJobPausesAndFailsNoTile) {
  const std::string id = register_worker();
  lose();
  told_with_a_lease(id);
  hand_back(id);
  EXPECT_EQ(farm.job(job).state, JobState::kPaused);
  EXPECT_THAT(farm.job(job).message,
              AllOf(HasSubstr("scene.pbrt"), HasSubstr("goes on by itself once it is back")));
  grant = {};
  EXPECT_THAT(told_with_a_lease(id), ElementsAre(digest));
  EXPECT_TRUE(grant.job.value.empty());
  EXPECT_EQ(farm.stats().failures, 0u);

  EXPECT_TRUE(upload(digest, 5, "scene").ok());  // somebody submits it again
  wanted.look_around();
  EXPECT_NE(farm.job(job).state, JobState::kPaused);
  EXPECT_THAT(farm.job(job).message, Not(HasSubstr("lost")));
  EXPECT_THAT(told_with_a_lease(id), IsEmpty());
  EXPECT_EQ(grant.job, job);
}

TEST_F(WantedBlobsTest, WhoHoldsNoLeasePausesNoJob) {
  const std::string id = register_worker(), stranger = register_worker();
  lose();
  told_with_a_lease(id);
  hand_back(stranger);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
}

TEST_F(WantedBlobsTest, AWorkerBringsWhatWasLostAndTheJobIsDone) {
  const std::string id = register_worker();
  lose();
  told_with_a_lease(id);
  hand_back(id);
  EXPECT_EQ(hand_in(digest, 4, "scen").error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "another size";
  EXPECT_EQ(hand_in(digest, 5, "skene").error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "a lie";
  EXPECT_EQ(hand_in(digest, 5, "scene and more").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(hand_in(digest, 5, "sc").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(hand_in(sha256_hex("other"), 5, "other").error_code(), grpc::StatusCode::ABORTED);
  EXPECT_FALSE(blobs.contains(digest));
  EXPECT_TRUE(hand_in(digest, 5, "scene").ok());
  EXPECT_TRUE(blobs.verify(digest));
  EXPECT_THAT(wanted.named(), IsEmpty());
  EXPECT_EQ(hand_in(digest, 5, "scene").error_code(), grpc::StatusCode::ABORTED) << "it is there";
  while (const auto next = lease(id)) EXPECT_EQ(commit(id, *next), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(WantedBlobsTest, OnlyARegisteredWorkerBringsIt) {
  lose();
  wanted.look_around();
  const std::string right = bringer;
  for (const std::string& wrong : {std::string(), WorkerKeys::shown(right).value, right + "0"}) {
    bringer = wrong;
    EXPECT_EQ(hand_in(digest, 5, "scene").error_code(), grpc::StatusCode::NOT_FOUND) << wrong;
  }
  bringer = right;
  EXPECT_TRUE(hand_in(digest, 5, "scene").ok());
}

TEST_F(WantedBlobsTest, OneWorkerAtATimeBringsIt) {
  lose();
  wanted.look_around();
  {
    const auto first = wanted.claim(digest);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->size, 5u);
    EXPECT_FALSE(wanted.claim(digest));
    EXPECT_THAT(wanted.named(), IsEmpty()) << "others need not try";
  }
  EXPECT_THAT(wanted.named(), ElementsAre(digest)) << "it has given up";
}

TEST_F(WantedBlobsTest, ASlowOneKeepsNobodyFromBringingIt) {
  FakeClock time;
  WantedBlobs patient(farm, blobs, time);
  lose();
  patient.look_around();
  std::vector<std::unique_ptr<WantedBlobs::Claim>> claims;
  for (int i = 0; i < WantedBlobs::kMostClaims; ++i) {
    claims.push_back(patient.claim(digest));
    EXPECT_TRUE(claims.back());
    EXPECT_FALSE(patient.claim(digest));
    time.advance(WantedBlobs::kClaimSeconds);
  }
  EXPECT_FALSE(patient.claim(digest)) << "all are slow";
  EXPECT_THAT(patient.named(), IsEmpty());
  claims.pop_back();
  EXPECT_TRUE(patient.claim(digest));
}

TEST_F(WantedBlobsTest, WhatNoJobNeedsAnyMoreIsNotWanted) {
  lose();
  wanted.look_around();
  EXPECT_THAT(wanted.named(), ElementsAre(digest));
  farm.cancel(job);
  wanted.look_around();
  EXPECT_THAT(wanted.named(), IsEmpty());
}

TEST_F(WantedBlobsTest, FewAreNamedAtOnce) {
  JobRequest request = small_job(32, 32, 4);
  request.bundle.entries.clear();
  for (int i = 0; i < 100; ++i) {
    const std::string name = std::to_string(1000 + i);
    request.bundle.entries.push_back({name, sha256_hex(name), 4});
  }
  request.bundle.main = "1000";
  const JobId large = farm.submit(request);
  for (int i = 0; i < 3; ++i) wanted.look_around();
  EXPECT_EQ(wanted.named().size(), WantedBlobs::kMostNamed);
  EXPECT_THAT(farm.job(large).message, HasSubstr("1000 (blob"));
  EXPECT_THAT(farm.job(large).message, HasSubstr("and 99 other files of its scene are lost"));
}

TEST_F(WantedBlobsTest, AFileThatHasLostItsEndIsLost) {
  blobs_damage(digest, "sc");
  wanted.look_around();
  EXPECT_THAT(wanted.named(), ElementsAre(digest));
  EXPECT_EQ(blobs.damaged(), 1u);
}

}  // namespace
}  // namespace lightmill
