#pragma once
// A coordinator's servers in this process over a farm in memory, and what clients and workers call there.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/base/digest.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "coordinator/server.h"
#include "coordinator/store/memory_job_store.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/worker.grpc.pb.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest()
      : blobs(folder.file("blobs")),
        farm(std::make_unique<MemoryJobStore>(), clock, fake_options()),
        wanted(farm, blobs, clock),
        server(std::make_unique<Server>(options(&wanted), farm, blobs)) {
    channel = make_channel({"127.0.0.1:" + std::to_string(server->rpc_port())});
    client = v1::ClientService::NewStub(channel);
    worker = v1::WorkerService::NewStub(channel);
  }

  /// Another content under a blob's name, as a disk may give it back. The file's times differ, whatever the
  /// resolution of the system's clock.
  void blobs_damage(const std::string& digest, const std::string& content) {
    const std::string path = blobs.path(digest);
    std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
    std::filesystem::last_write_time(path, std::filesystem::last_write_time(path) + std::chrono::hours(1));
  }

  template <class Stub, class Request, class Response>
  grpc::Status call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    return (stub.*method)(&context, request, response);
  }

  grpc::Status upload(const std::string& digest, uint64_t size, const std::string& content) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    v1::UploadBlobsResponse response;
    auto writer = client->UploadBlobs(&context, &response);
    v1::UploadBlobsRequest message;
    message.mutable_header()->set_digest(digest);
    message.mutable_header()->set_size(size);
    writer->Write(message);
    for (size_t at = 0; at < content.size(); at += 3) {
      message.set_chunk(content.substr(at, 3));
      writer->Write(message);
    }
    writer->WritesDone();
    return writer->Finish();
  }

  v1::SubmitJobRequest submit_request(int64_t spp, Integrator integrator = Integrator::kBdpt) {
    v1::SubmitJobRequest request;
    request.set_name("job");
    request.set_bundle_json(bundle_to_json(fake_bundle()));
    request.set_settings_json(settings_to_json(small_settings(64, 64, spp, integrator)));
    return request;
  }
  std::string submit(int64_t spp, Integrator integrator = Integrator::kBdpt) {
    EXPECT_TRUE(upload(sha256_hex("scene"), 5, "scene").ok());
    v1::SubmitJobResponse response;
    const grpc::Status status =
        call(*client, &v1::ClientService::Stub::SubmitJob, submit_request(spp, integrator), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.job_id();
  }
  std::string register_worker() {
    v1::RegisterRequest request;
    *request.mutable_registration() = to_proto(registration());
    v1::RegisterResponse response;
    EXPECT_TRUE(call(*worker, &v1::WorkerService::Stub::Register, request, &response).ok());
    return response.worker_id();
  }
  std::optional<LeaseGrant> lease(const std::string& id, double wait = 0) {
    v1::LeaseRequest request;
    request.set_worker_id(id);
    request.set_wait_seconds(wait);
    v1::LeaseResponse response;
    EXPECT_TRUE(call(*worker, &v1::WorkerService::Stub::Lease, request, &response).ok());
    if (!response.has_grant()) return std::nullopt;
    return from_proto(response.grant());
  }
  grpc::Status commit(const std::string& id, const LeaseKey& key, const std::string& bytes, uint64_t size,
                      const std::string& digest, v1::CommitResponse* response) {
    grpc::ClientContext context;
    set_deadline(context, 30);
    auto writer = worker->Commit(&context, response);
    v1::CommitRequest message;
    message.mutable_header()->set_worker_id(id);
    *message.mutable_header()->mutable_key() = to_proto(key);
    message.mutable_header()->set_size(size);
    message.mutable_header()->set_digest(digest);
    writer->Write(message);
    for (size_t at = 0; at < bytes.size(); at += 10000) {
      message.set_chunk(bytes.substr(at, 10000));
      if (!writer->Write(message)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }
  v1::CommitOutcome commit(const std::string& id, const LeaseGrant& grant) {
    v1::CommitResponse response;
    const std::string bytes = fake_bytes(grant);
    const grpc::Status status = commit(id, {grant.job, grant.tile_id, grant.attempt}, bytes, bytes.size(),
                                       sha256_hex(bytes), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.outcome();
  }

  static ServerOptions options(WantedBlobs* wanted) {
    ServerOptions options{"127.0.0.1:0", "127.0.0.1:0", false, 10};
    options.wanted = wanted;
    return options;
  }

  TemporaryFolder folder;
  SteadyClock clock;
  BlobStore blobs;
  Farm farm;
  WantedBlobs wanted;
  std::unique_ptr<Server> server;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::ClientService::Stub> client;
  std::unique_ptr<v1::WorkerService::Stub> worker;
};

}  // namespace lightmill::testing
