// A coordinator that stands by answers every call and page at once, with a line that says who leads.
#include "coordinator/standby.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <httplib.h>

#include "common/rpc/channel.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/worker.grpc.pb.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

ServerOptions anywhere() {
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  options.http = "127.0.0.1:0";
  return options;
}

TEST(Standby, SaysWhoLeads) {
  Standby standby(anywhere());
  const auto channel = make_channel({"127.0.0.1:" + std::to_string(standby.rpc_port())});
  const auto status = [&] {
    grpc::ClientContext context;
    set_deadline(context, kCallSeconds);
    v1::GetJobResponse response;
    return v1::ClientService::NewStub(channel)->GetJob(&context, {}, &response);
  };
  EXPECT_EQ(status().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status().error_message(), HasSubstr("another coordinator leads"));
  standby.set_leader("a.example.org:7070");
  EXPECT_EQ(status().error_message(), "standby: the coordinator at a.example.org:7070 leads this farm");

  grpc::ClientContext context;  // a stream of a worker's, which has begun to send
  set_deadline(context, kCallSeconds);
  v1::CommitResponse response;
  const auto writer = v1::WorkerService::NewStub(channel)->Commit(&context, &response);
  writer->Write({});
  writer->WritesDone();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);

  httplib::Client browser("127.0.0.1", standby.http_port());
  for (const char* page : {"/healthz", "/", "/api/jobs"}) {
    const auto answer = browser.Get(page);
    ASSERT_TRUE(answer) << page;
    EXPECT_EQ(answer->status, 503);
    EXPECT_THAT(answer->body, HasSubstr("a.example.org:7070 leads"));
  }
  const auto alive = browser.Get("/livez");
  ASSERT_TRUE(alive);
  EXPECT_EQ(alive->status, 200) << "nobody should restart it for standing by";
  const auto call = browser.Get("/v1/jobs");
  ASSERT_TRUE(call);
  EXPECT_EQ(call->status, 503);
  EXPECT_THAT(call->body, HasSubstr("\"code\":14"));
  const auto metrics = browser.Get("/metrics");
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->status, 200) << "nor call it down";
  EXPECT_THAT(metrics->body, HasSubstr("\nlightmill_coordinator_leading 0\n"));
}

TEST(Standby, LeavesItsPortsToTheServerThatFollows) {
  ServerOptions options = anywhere();
  {
    const Standby standby(options);
    options.listen = "127.0.0.1:" + std::to_string(standby.rpc_port());
    options.http = "127.0.0.1:" + std::to_string(standby.http_port());
    EXPECT_THROW(Standby{options}, Error) << "the ports are in use";
  }
  EXPECT_NO_THROW(Standby{options});
}

TEST(Standby, ListensInPlainTextOnLoopbackAlone) {
  ServerOptions options = anywhere();
  options.listen = "0.0.0.0:0";
  EXPECT_THROW(Standby{options}, Error);
}

}  // namespace
}  // namespace lightmill
