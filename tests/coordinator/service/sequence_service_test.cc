// Sequences over gRPC: every call, and what it refuses.
#include <gmock/gmock.h>

#include "common/rpc/sequence_messages.h"
#include "lightmill/v1/sequence.grpc.pb.h"
#include "tests/coordinator/service/service_fixture.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

class SequenceServiceTest : public testing::ServiceTest {
 protected:
  using Stub = v1::SequenceService::Stub;
  SequenceServiceTest() : sequences(v1::SequenceService::NewStub(channel)) {}

  static void add_frame(int number, v1::Frame* frame) {
    Bundle bundle = testing::fake_bundle();
    bundle.pose.time = number;
    frame->set_number(number);
    frame->set_bundle_json(bundle_to_json(bundle));
  }
  v1::SubmitSequenceRequest request(int first, int last, int64_t spp = 4) {
    v1::SubmitSequenceRequest made;
    made.set_name("shot");
    made.set_fps(25);
    made.set_order(v1::FRAME_ORDER_COARSE_FIRST);
    made.set_settings_json(settings_to_json(testing::small_settings(64, 64, spp)));
    for (int i = first; i <= last; ++i) add_frame(i, made.add_frames());
    return made;
  }
  std::string submit_frames(int first, int last) {
    EXPECT_TRUE(upload(sha256_hex("scene"), 5, "scene").ok());
    v1::SubmitSequenceResponse response;
    const grpc::Status status = call(*sequences, &Stub::SubmitSequence, request(first, last), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.sequence_id();
  }
  template <class Request, class Response>
  v1::SequenceStatus change(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                            const std::string& id) {
    Request made;
    made.set_sequence_id(id);
    Response response;
    const grpc::Status status = call(*sequences, method, made, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.sequence();
  }
  void work() {
    const std::string worker_id = register_worker();
    while (const auto grant = lease(worker_id)) commit(worker_id, *grant);
  }
  std::unique_ptr<Stub> sequences;
};

TEST_F(SequenceServiceTest, FromSubmissionToTheEnd) {
  const std::string id = submit_frames(1, 3);
  EXPECT_EQ(id, "s1");
  v1::AddFramesRequest more;
  more.set_sequence_id(id);
  more.set_settings_json(request(1, 1).settings_json());
  for (int i = 3; i <= 5; ++i) add_frame(i, more.add_frames());
  v1::AddFramesResponse added;
  ASSERT_TRUE(call(*sequences, &Stub::AddFrames, more, &added).ok());
  EXPECT_EQ(added.sequence().frame_count(), 5);
  EXPECT_EQ(change(&Stub::PauseSequence, id).state(), v1::JOB_STATE_PAUSED);
  EXPECT_EQ(change(&Stub::ResumeSequence, id).frames().queued(), 5);
  work();
  grpc::ClientContext context;
  set_deadline(context, 30);
  v1::WatchSequenceRequest watch;
  watch.set_sequence_id(id);
  const auto reader = sequences->WatchSequence(&context, watch);
  v1::WatchSequenceResponse last;
  while (reader->Read(&last)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  const SequenceStatus status = from_proto(last.sequence());
  EXPECT_EQ(status.state, JobState::kDone);
  EXPECT_EQ(status.frames[static_cast<int>(JobState::kDone)], 5);
  EXPECT_EQ(status.request.order, FrameOrder::kCoarseFirst);
  EXPECT_EQ(status.request.fps, 25);
  EXPECT_EQ(status.last_frame, 5);

  v1::ListFramesRequest page;
  page.set_sequence_id(id);
  page.set_page_size(2);
  std::vector<int> numbers;
  do {
    v1::ListFramesResponse frames;
    ASSERT_TRUE(call(*sequences, &Stub::ListFrames, page, &frames).ok());
    for (const v1::FrameStatus& frame : frames.frames()) {
      numbers.push_back(frame.number());
      EXPECT_EQ(frame.spp(), 4);
      EXPECT_EQ(frame.job_id(), id + "." + std::to_string(frame.number()));
    }
    EXPECT_EQ(frames.total_size(), 5);
    page.set_page_token(frames.next_page_token());
  } while (!page.page_token().empty());
  EXPECT_EQ(numbers, (std::vector{1, 2, 3, 4, 5}));
  v1::ListSequencesResponse list;
  ASSERT_TRUE(call(*sequences, &Stub::ListSequences, v1::ListSequencesRequest(), &list).ok());
  EXPECT_EQ(list.sequences_size(), 1);

  v1::ListJobsRequest jobs;
  jobs.set_page_size(10);
  jobs.set_without_frames(true);
  v1::ListJobsResponse singles;
  ASSERT_TRUE(call(*client, &v1::ClientService::Stub::ListJobs, jobs, &singles).ok());
  EXPECT_EQ(singles.jobs_size(), 0);
  EXPECT_EQ(singles.next_page_token(), "");
}

TEST_F(SequenceServiceTest, RefusesInOneLine) {
  v1::SubmitSequenceResponse response;
  grpc::Status status = call(*sequences, &Stub::SubmitSequence, request(1, 2), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << "nothing was uploaded";
  const std::string id = submit_frames(1, 2);
  v1::SubmitSequenceRequest bad = request(1, 0);
  EXPECT_EQ(call(*sequences, &Stub::SubmitSequence, bad, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  bad = request(1, 2);
  bad.mutable_frames(1)->set_bundle_json("{");
  EXPECT_EQ(call(*sequences, &Stub::SubmitSequence, bad, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  bad = request(1, 2);
  bad.set_settings_json("");
  EXPECT_EQ(call(*sequences, &Stub::SubmitSequence, bad, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  bad = request(1, 2);
  bad.set_fps(-1);
  EXPECT_EQ(call(*sequences, &Stub::SubmitSequence, bad, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  bad = request(1, 1001);
  status = call(*sequences, &Stub::SubmitSequence, bad, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("at most 1000 frames"));

  v1::GetSequenceRequest unknown;
  unknown.set_sequence_id("s9");
  v1::GetSequenceResponse got;
  status = call(*sequences, &Stub::GetSequence, unknown, &got);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("no sequence \"s9\""));
  v1::ListFramesRequest page;
  page.set_sequence_id(id);
  page.set_page_token("frame-x");
  v1::ListFramesResponse frames;
  EXPECT_EQ(call(*sequences, &Stub::ListFrames, page, &frames).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  page.clear_page_token();
  page.set_page_size(-1);
  EXPECT_EQ(call(*sequences, &Stub::ListFrames, page, &frames).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  grpc::ClientContext context;
  set_deadline(context, 30);
  v1::WatchSequenceRequest watch;
  watch.set_sequence_id("s9");
  v1::WatchSequenceResponse message;
  const auto reader = sequences->WatchSequence(&context, watch);
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace lightmill
