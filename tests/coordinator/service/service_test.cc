// The gRPC services over a real server in this process.
#include <gmock/gmock.h>

#include <set>
#include <thread>

#include "common/rpc/registration_digest.h"
#include "common/rpc/status.h"
#include "tests/coordinator/service/service_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

// A bit that the line has changed could name another arithmetic class.
TEST_F(ServiceTest, ADamagedRegistrationIsAskedForAgain) {
  v1::RegisterRequest request;
  *request.mutable_registration() = to_proto(registration());
  const std::string digest = registration_digest(request.registration());
  const auto send = [&] {
    grpc::ClientContext context;
    set_deadline(context, 30);
    context.AddMetadata(kRegistrationDigestKey, digest);
    v1::RegisterResponse response;
    return worker->Register(&context, request, &response);
  };
  EXPECT_TRUE(send().ok());
  request.mutable_registration()->mutable_arithmetic_class()->back() ^= 1;
  const grpc::Status status = send();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(status.error_message(), "the registration was damaged on its way: its digest differs");
}

TEST_F(ServiceTest, SubmitLeaseCommitWatchFetch) {
  const std::string job = submit(20);
  std::vector<JobStatus> watched;
  std::thread watcher([&] {
    grpc::ClientContext context;
    set_deadline(context, 60);
    v1::WatchJobRequest request;
    request.set_job_id(job);
    const auto reader = client->WatchJob(&context, request);
    v1::WatchJobResponse message;
    while (reader->Read(&message)) watched.push_back(from_proto(message.job()));
    EXPECT_TRUE(reader->Finish().ok());
  });
  const std::string id = register_worker();
  while (const auto grant = lease(id)) EXPECT_EQ(commit(id, *grant), v1::COMMIT_OUTCOME_ACCEPTED);
  watcher.join();
  ASSERT_FALSE(watched.empty());
  EXPECT_EQ(watched.back().state, JobState::kDone);
  EXPECT_EQ(watched.back().spp, 20);

  grpc::ClientContext context;
  v1::FetchImageRequest request;
  request.set_job_id(job);
  const auto reader = client->FetchImage(&context, request);
  v1::FetchImageResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_EQ(message.header().width(), 64);
  EXPECT_EQ(message.header().metadata().at("job"), job);
  Image image(message.header().width(), message.header().height());
  std::string bytes;
  while (reader->Read(&message)) bytes += message.chunk();
  EXPECT_TRUE(reader->Finish().ok());
  ASSERT_EQ(bytes.size(), image.data.size() * sizeof(float));
  std::memcpy(image.data.data(), bytes.data(), bytes.size());
  EXPECT_TRUE(same_pixels(image, fake_image(small_settings(64, 64, 20))));

  grpc::ClientContext tiles_context;
  v1::ListTilesRequest tiles_request;
  tiles_request.set_job_id(job);
  const auto tiles = client->ListTiles(&tiles_context, tiles_request);
  v1::ListTilesResponse tiles_message;
  int64_t count = 0;
  while (tiles->Read(&tiles_message)) {
    for (const auto& tile : tiles_message.tiles()) {
      EXPECT_EQ(from_proto(tile).id.value, count++);
      EXPECT_EQ(tile.state(), v1::TILE_STATE_COMMITTED);
    }
  }
  EXPECT_EQ(count, watched.back().tiles_committed);

  v1::GetCurveRequest curve_request;
  curve_request.set_job_id(job);
  v1::GetCurveResponse curve;
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::GetCurve, curve_request, &curve).ok());
  EXPECT_EQ(curve.curve().points(curve.curve().points_size() - 1).spp(), 20);
}

TEST_F(ServiceTest, APilotTravelsAndItsReportComesWithTheJob) {
  v1::GetJobRequest request;
  request.set_job_id(submit(4, Integrator::kAuto));
  const auto get = [&] {
    v1::GetJobResponse response;
    EXPECT_TRUE(call(*client, &v1::ClientService::Stub::GetJob, request, &response).ok());
    return response;
  };
  const std::string id = register_worker();
  const LeaseGrant pilot = lease(id).value();
  EXPECT_TRUE(is_pilot(pilot.tile));
  EXPECT_EQ(get().job().message(), "choosing strategies");
  EXPECT_FALSE(get().has_pilot_json());
  v1::CommitResponse response;
  const std::string large(kMaxPilotResultBytes + 1, ' ');
  EXPECT_EQ(commit(id, {pilot.job, pilot.tile_id, 1}, large, large.size(), sha256_hex(large), &response)
                .error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(commit(id, pilot), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(get().pilot_json(), pilot_to_json(fake_pilot()));
  EXPECT_EQ(from_proto(get().job()).settings.plan, fake_pilot().chosen);
}

TEST_F(ServiceTest, StatusCodes) {
  v1::GetJobResponse response;
  v1::GetJobRequest request;
  request.set_job_id("j404");
  grpc::Status status = call(*client, &v1::ClientService::Stub::GetJob, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("no job \"j404\""));

  v1::SubmitJobResponse submitted;
  status = call(*client, &v1::ClientService::Stub::SubmitJob, submit_request(4), &submitted);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("scene.pbrt"));
  for (int broken = 0; broken < 3; ++broken) {
    v1::SubmitJobRequest bad = submit_request(4);
    if (broken == 0) bad.set_bundle_json("{");
    if (broken == 1) bad.set_settings_json("{}");
    if (broken == 2) bad.set_settings_json("[1,2");
    status = call(*client, &v1::ClientService::Stub::SubmitJob, bad, &submitted);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), ::testing::Not(HasSubstr("\n")));
  }

  v1::LeaseRequest lease_request;
  lease_request.set_worker_id("w404");
  v1::LeaseResponse lease_response;
  status = call(*worker, &v1::WorkerService::Stub::Lease, lease_request, &lease_response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  lease_request.set_wait_seconds(1e9);
  status = call(*worker, &v1::WorkerService::Stub::Lease, lease_request, &lease_response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  v1::RegisterRequest stranger;
  *stranger.mutable_registration() = to_proto(registration());
  stranger.mutable_registration()->set_build("another");
  v1::RegisterResponse refused;
  status = call(*worker, &v1::WorkerService::Stub::Register, stranger, &refused);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(to_error(status, "x").exit_code(), 3);

  v1::PauseJobRequest pause;
  v1::PauseJobResponse paused;
  pause.set_job_id(submit(4));
  EXPECT_TRUE(call(*client, &v1::ClientService::Stub::PauseJob, pause, &paused).ok());
  EXPECT_EQ(paused.job().state(), v1::JOB_STATE_PAUSED);
  status = call(*client, &v1::ClientService::Stub::PauseJob, pause, &paused);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(ServiceTest, JobsAreListedInPages) {
  std::vector<std::string> submitted;
  for (int i = 0; i < 7; ++i) submitted.push_back(submit(4));
  const auto list = [&](int size, const std::string& token) {
    v1::ListJobsRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    v1::ListJobsResponse response;
    const grpc::Status status = call(*client, &v1::ClientService::Stub::ListJobs, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  for (const int size : {1, 3, 7, 100}) {
    std::vector<std::string> listed;
    std::string token;
    do {
      const v1::ListJobsResponse page = list(size, token);
      EXPECT_LE(page.jobs_size(), size);
      EXPECT_EQ(page.total_size(), 7);
      for (const v1::JobStatus& job : page.jobs()) listed.push_back(job.id());
      token = page.next_page_token();
      ASSERT_LE(listed.size(), submitted.size());
    } while (!token.empty());
    EXPECT_EQ(listed, submitted);
  }
  const v1::ListJobsResponse first = list(3, "");
  EXPECT_EQ(list(0, first.next_page_token()).jobs_size(), 4) << "the page may change its size";
  const std::string late = submit(4);  // while a client turns pages
  EXPECT_EQ(list(100, first.next_page_token()).jobs(4).id(), late);

  const v1::ListJobsResponse old = list(0, "");  // as clients that know of no pages
  EXPECT_EQ(old.jobs_size(), 8);
  EXPECT_TRUE(old.next_page_token().empty());

  for (const char* token : {"j1", "job-", "job-0", "job--1", "job-1x", "job-99999999999999999999"}) {
    v1::ListJobsRequest request;
    request.set_page_token(token);
    v1::ListJobsResponse response;
    const grpc::Status status = call(*client, &v1::ClientService::Stub::ListJobs, request, &response);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << token;
  }
  EXPECT_EQ(list(5, "job-4000000000").jobs_size(), 0);
  v1::ListJobsRequest negative;
  negative.set_page_size(-1);
  v1::ListJobsResponse response;
  EXPECT_EQ(call(*client, &v1::ClientService::Stub::ListJobs, negative, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ServiceTest, WorkersAreListedInPages) {
  std::set<std::string> registered;
  for (int i = 0; i < 12; ++i) {  // the id alone: others must not learn the key behind it
    const std::string name = register_worker();
    registered.insert(name.substr(0, name.find('.')));
  }
  WorkerRegistration stranger = registration();
  stranger.build = "another";
  EXPECT_THROW(farm.register_worker(stranger), Error);
  const auto list = [&](int size, const std::string& token,
                        grpc::StatusCode expected = grpc::StatusCode::OK) {
    v1::ListWorkersRequest request;
    request.set_page_size(size);
    request.set_page_token(token);
    v1::ListWorkersResponse response;
    const grpc::Status status = call(*client, &v1::ClientService::Stub::ListWorkers, request, &response);
    EXPECT_EQ(status.error_code(), expected) << token << ": " << status.error_message();
    return response;
  };
  for (const int size : {1, 5, 12, 100}) {
    std::set<std::string> listed;
    int refused = 0;
    std::string token;
    do {
      const v1::ListWorkersResponse page = list(size, token);
      EXPECT_LE(page.workers_size(), size + 1) << "with those that were refused";
      EXPECT_EQ(page.total_size(), 13);
      for (const v1::WorkerStatus& row : page.workers()) {
        if (row.state() == v1::WORKER_STATE_REFUSED) {
          ++refused;
        } else {
          EXPECT_TRUE(listed.insert(row.id()).second) << row.id() << " is listed twice";
        }
      }
      token = page.next_page_token();
      ASSERT_LE(listed.size(), registered.size());
    } while (!token.empty());
    EXPECT_EQ(listed, registered);
    EXPECT_EQ(refused, 1);
  }
  const v1::ListWorkersResponse old = list(0, "");  // as clients that know of no pages
  EXPECT_EQ(old.workers_size(), 13);
  EXPECT_TRUE(old.next_page_token().empty());
  EXPECT_EQ(list(0, list(3, "").next_page_token()).workers_size(), 10) << "the page may change its size";
  EXPECT_EQ(list(5, "after-zzz").workers_size(), 1) << "whom it names may be gone by now";
  for (const char* token : {"w1", "after-", "job-1"}) list(5, token, grpc::StatusCode::INVALID_ARGUMENT);
  list(-1, "", grpc::StatusCode::INVALID_ARGUMENT);
}

// What one message can't hold: about fifty thousand workers with names of usual length.
TEST_F(ServiceTest, WhoKnowsOfNoPagesGetsWhatAMessageHolds) {
  WorkerRegistration wordy = registration();
  wordy.host = wordy.arithmetic_class = wordy.pool = std::string(1000, 'x');
  for (int i = 0; i < 4000; ++i) farm.register_worker(wordy);
  v1::ListWorkersResponse response;
  const grpc::Status status =
      call(*client, &v1::ClientService::Stub::ListWorkers, v1::ListWorkersRequest(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.total_size(), 4000);
  EXPECT_GT(response.workers_size(), 1000);
  EXPECT_LT(response.workers_size(), 4000);
}

TEST_F(ServiceTest, BlobsAreVerifiedAndComeBack) {
  const std::string content = "the content of a texture";
  const std::string digest = sha256_hex(content);
  EXPECT_EQ(upload(digest, content.size(), "the kontent of a texture").error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(upload(digest, content.size() + 1, content).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(upload("../../evil", content.size(), content).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(upload(digest, uint64_t{1} << 60, content).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);

  v1::FindMissingBlobsRequest find;
  find.add_digests(digest);
  v1::FindMissingBlobsResponse missing;
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::FindMissingBlobs, find, &missing).ok());
  EXPECT_EQ(missing.digests_size(), 1);
  EXPECT_TRUE(upload(digest, content.size(), content).ok());
  EXPECT_TRUE(upload(digest, content.size(), content).ok()) << "twice is fine";
  missing.Clear();
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::FindMissingBlobs, find, &missing).ok());
  EXPECT_EQ(missing.digests_size(), 0);

  for (const bool known : {true, false}) {
    grpc::ClientContext context;
    v1::FetchBlobsRequest request;
    request.add_digests(known ? digest : sha256_hex("unknown"));
    const auto reader = worker->FetchBlobs(&context, request);
    v1::FetchBlobsResponse message;
    std::string received;
    while (reader->Read(&message)) {
      if (message.has_header()) {
        EXPECT_EQ(message.header().size(), content.size());
      }
      received += message.chunk();
    }
    EXPECT_EQ(reader->Finish().error_code(), known ? grpc::StatusCode::OK : grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(received, known ? content : "");
  }
}

TEST_F(ServiceTest, ADamagedBlobIsNamedWhenItIsSubmittedAgain) {
  const std::string digest = sha256_hex("scene");
  submit(4);
  blobs_damage(digest, "skene");
  v1::FindMissingBlobsRequest find;
  find.add_digests(digest);
  v1::FindMissingBlobsResponse missing;
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::FindMissingBlobs, find, &missing).ok());
  ASSERT_EQ(missing.digests_size(), 1);
  submit(8);  // uploads it
  missing.Clear();
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::FindMissingBlobs, find, &missing).ok());
  EXPECT_EQ(missing.digests_size(), 0);
}

TEST_F(ServiceTest, ADamagedBlobIsFoundWhileItIsSentAndSentNoMore) {
  const std::string digest = sha256_hex("scene");
  submit(4);
  blobs_damage(digest, "skene");
  for (const grpc::StatusCode expected : {grpc::StatusCode::DATA_LOSS, grpc::StatusCode::NOT_FOUND}) {
    grpc::ClientContext context;
    v1::FetchBlobsRequest request;
    request.add_digests(digest);
    const auto reader = worker->FetchBlobs(&context, request);
    v1::FetchBlobsResponse message;
    while (reader->Read(&message)) continue;
    EXPECT_EQ(reader->Finish().error_code(), expected);
  }
  EXPECT_EQ(blobs.damaged(), 1u);
}

TEST_F(ServiceTest, AJobWhoseFileHasLostItsEndIsAskedToSendItAgain) {
  submit(4);
  blobs_damage(sha256_hex("scene"), "sc");
  v1::SubmitJobResponse response;
  const grpc::Status status =
      call(*client, &v1::ClientService::Stub::SubmitJob, submit_request(8), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("damaged on the coordinator; submit it again"));
  submit(8);
}

TEST_F(ServiceTest, CommitsThatLieAreRefused) {
  submit(4);
  const std::string id = register_worker();
  const LeaseGrant grant = lease(id).value();
  const LeaseKey key{grant.job, grant.tile_id, grant.attempt};
  const std::string bytes = fake_bytes(grant);
  v1::CommitResponse response;
  EXPECT_EQ(commit(id, key, bytes, bytes.size(), sha256_hex("other"), &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(commit(id, key, bytes, bytes.size() - 1, sha256_hex(bytes), &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(commit(id, key, bytes, bytes.size() + 1, sha256_hex(bytes), &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(commit(id, key, bytes, uint64_t{1} << 50, sha256_hex(bytes), &response).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(
      commit(id, {JobId{"j404"}, TileId{0}, 1}, bytes, bytes.size(), sha256_hex(bytes), &response).ok());
  EXPECT_EQ(response.outcome(), v1::COMMIT_OUTCOME_UNKNOWN_JOB);
  {
    grpc::ClientContext context;
    auto writer = worker->Commit(&context, &response);
    v1::CommitRequest message;
    message.set_chunk("no header");
    writer->Write(message);
    writer->WritesDone();
    EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  EXPECT_EQ(commit(id, grant), v1::COMMIT_OUTCOME_ACCEPTED)
      << "the lease was not touched by damage on the way";
  EXPECT_EQ(commit(id, grant), v1::COMMIT_OUTCOME_ALREADY_COMMITTED);
}

TEST_F(ServiceTest, CommitsWithoutALeaseAreAnsweredAtTheirHeader) {
  submit(8);
  const std::string id = register_worker(), other = register_worker();
  const LeaseGrant grant = lease(id).value();
  const auto announced = [&](const std::string& who, LeaseKey key) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    v1::CommitResponse response;
    const auto writer = worker->Commit(&context, &response);
    v1::CommitRequest message;
    message.mutable_header()->set_worker_id(who);
    *message.mutable_header()->mutable_key() = to_proto(key);
    message.mutable_header()->set_size(uint64_t{1} << 50);  // that nobody makes room for
    writer->Write(message);
    const grpc::Status status = writer->Finish();  // and it sends no more
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.outcome();
  };
  const LeaseKey key{grant.job, grant.tile_id, grant.attempt};
  EXPECT_EQ(announced(other, key), v1::COMMIT_OUTCOME_STALE) << "the lease of another";
  EXPECT_EQ(announced(id, {grant.job, grant.tile_id, grant.attempt + 1}), v1::COMMIT_OUTCOME_STALE);
  EXPECT_EQ(announced(id, {grant.job, TileId{1000000}, 1}), v1::COMMIT_OUTCOME_UNKNOWN_JOB);
  EXPECT_EQ(announced(id, {JobId{"j404"}, TileId{0}, 1}), v1::COMMIT_OUTCOME_UNKNOWN_JOB);
  EXPECT_EQ(commit(id, grant), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(announced(id, key), v1::COMMIT_OUTCOME_ALREADY_COMMITTED);
}

TEST_F(ServiceTest, PortsInUseAndPlainTextAreRefused) {
  const std::string rpc = "127.0.0.1:" + std::to_string(server->rpc_port());
  const std::string http = "127.0.0.1:" + std::to_string(server->http_port());
  const auto start = [&](const std::string& listen, const std::string& http_address) {
    const Server other({listen, http_address, false, 10}, farm, blobs);
  };
  EXPECT_THROW(start(rpc, "127.0.0.1:0"), Error);
  EXPECT_THROW(start("127.0.0.1:0", http), Error);
  EXPECT_THROW(start("0.0.0.0:0", ""), Error);
  EXPECT_THROW(start("127.0.0.1:0", "0.0.0.0:0"), Error);
  EXPECT_THROW(start("nonsense", ""), Error);
}

TEST_F(ServiceTest, ShutdownEndsStreamsAndPolls) {
  const std::string job = submit(4);
  const std::string id = register_worker();
  farm.pause(JobId{job});
  std::thread poller([&] {
    grpc::ClientContext context;
    v1::LeaseRequest request;
    request.set_worker_id(id);
    request.set_wait_seconds(20);
    v1::LeaseResponse response;
    // CANCELLED if the call had not reached its handler yet.
    EXPECT_THAT(worker->Lease(&context, request, &response).error_code(),
                ::testing::AnyOf(grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::CANCELLED));
  });
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_job_id(job);
  const auto reader = client->WatchJob(&context, request);
  v1::WatchJobResponse message;
  ASSERT_TRUE(reader->Read(&message));
  server.reset();
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  poller.join();
}

}  // namespace
}  // namespace lightmill
