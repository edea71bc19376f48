// Requests by hand, as no client library writes them: each has its bounds before it is unpacked.
#include "common/rpc/request_limits.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <future>

#include "tests/coordinator/service/service_fixture.h"

namespace lightmill::testing {
namespace {

using ::testing::HasSubstr;

class RequestLimits : public ServiceTest {
 protected:
  /// Sends `bytes` to an RPC.
  grpc::Status send(const std::string& rpc, const std::string& bytes) {
    grpc::GenericStub stub(channel);
    const grpc::Slice slice(bytes);
    const grpc::ByteBuffer request(&slice, 1);
    grpc::ByteBuffer response;
    grpc::ClientContext context;
    set_deadline(context, 30);
    std::promise<grpc::Status> done;
    stub.UnaryCall(&context, "/lightmill.v1." + rpc, {}, &request, &response,
                   [&](const grpc::Status& status) { done.set_value(status); });
    return done.get_future().get();
  }
  static std::string repeated(const std::string& field, int times) {
    std::string out;
    for (int i = 0; i < times; ++i) out += field;
    return out;
  }
};

TEST_F(RequestLimits, EveryRequestHasOne) {
  for (const auto* file : {v1::GetJobRequest::descriptor()->file(), v1::PutBlobRequest::descriptor()->file(),
                           v1::RenewRequest::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        const std::string name = file->service(s)->method(m)->input_type()->full_name();
        EXPECT_TRUE(request_limit(name)) << name;
      }
    }
  }
  EXPECT_FALSE(request_limit("lightmill.v1.ListJobsResponse"));
}

TEST_F(RequestLimits, BytesAreBounded) {
  // Field 200, which the protocol does not have, of 5000 bytes.
  const std::string unknown = std::string("\xc2\x0c\x88\x27") + std::string(5000, 'x');
  for (const char* rpc : {"ClientService/GetJob", "ClientService/ListJobs", "ClientService/CancelJob",
                          "WorkerService/Drain", "WorkerService/GetBundle"}) {
    const grpc::Status status = send(rpc, unknown);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << rpc << ": " << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("it may have 4096")) << rpc;
  }
}

TEST_F(RequestLimits, CallbacksHaveThemToo) {
  // gRPC answers UNIMPLEMENTED where it could not read the request of a callback.
  EXPECT_FALSE(send("WorkerService/Lease", std::string("\xc2\x0c\x88\x27") + std::string(5000, 'x')).ok());
}

TEST_F(RequestLimits, ListsAreBounded) {
  // Empty elements of field 1 (digests) or 2 (leases), two bytes each.
  EXPECT_EQ(send("WorkerService/Renew", repeated(std::string("\x12\0", 2), 20000)).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(send("ClientService/FindMissingBlobs", repeated(std::string("\x0a\0", 2), 200000)).error_code(),
            grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(RequestLimits, WhatIsAllowedPasses) {
  v1::FindMissingBlobsRequest request;
  for (int i = 0; i < 100000; ++i) request.add_digests(std::string(58, 'a') + std::to_string(100000 + i));
  v1::FindMissingBlobsResponse response;
  EXPECT_TRUE(call(*client, &v1::ClientService::Stub::FindMissingBlobs, request, &response).ok());
  EXPECT_EQ(response.digests_size(), 100000);
}

TEST_F(RequestLimits, UnknownFieldsAreNoError) {
  v1::GetJobRequest request;
  request.set_job_id("none");
  EXPECT_EQ(send("ClientService/GetJob", request.SerializeAsString() + "\xc2\x0c\x01x").error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(RequestLimits, DamagedRequestsAreRefused) {
  EXPECT_EQ(send("ClientService/GetJob", "\x0a\x7f").error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

}  // namespace
}  // namespace lightmill::testing
