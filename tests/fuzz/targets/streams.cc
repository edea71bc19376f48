// The calls that are callbacks, over gRPC: the first byte chooses the RPC, what follows
// are its messages, each of two bytes for the length and so many bytes. Messages that name any worker are of
// the one that has a lease; those that are no messages are sent as they are. Of answers the first is read.
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/server_builder.h>

#include <algorithm>
#include <vector>

#include "tests/fuzz/targets/coordinator.h"

namespace {

using namespace lightmill;

struct Method {
  const char* name;
  /// A message with the worker's name in place of any.
  std::string (*as_worker)(const std::string& name, const std::string& bytes);
};

std::string as_it_is(const std::string&, const std::string& bytes) { return bytes; }

template <class Request>
std::string with_header(const std::string& name, const std::string& bytes) {
  Request message;
  if (!message.ParseFromString(bytes)) return bytes;
  if (message.has_header() && !message.header().worker_id().empty())
    message.mutable_header()->set_worker_id(name);
  return message.SerializeAsString();
}

std::string lease_request(const std::string& name, const std::string& bytes) {
  v1::LeaseRequest message;
  if (!message.ParseFromString(bytes)) return bytes;
  if (!message.worker_id().empty()) message.set_worker_id(name);
  if (message.wait_seconds() > 0 && message.wait_seconds() <= 20) message.set_wait_seconds(0);
  return message.SerializeAsString();
}

const Method kMethods[] = {
    {"/lightmill.v1.ClientService/UploadBlobs", as_it_is},
    {"/lightmill.v1.WorkerService/Commit", with_header<v1::CommitRequest>},
    {"/lightmill.v1.WorkerService/HandInBlob", with_header<v1::HandInBlobRequest>},
    {"/lightmill.v1.WorkerService/Lease", lease_request},
    {"/lightmill.v1.WorkerService/FetchBlobs", as_it_is},
    {"/lightmill.v1.ClientService/ListTiles", as_it_is},
    {"/lightmill.v1.ClientService/WatchJob", as_it_is},
    {"/lightmill.v1.ClientService/FetchImage", as_it_is},
    {"/lightmill.v1.ClientService/GetLogs", as_it_is},
};

std::vector<std::string> split(const uint8_t* data, size_t size) {
  std::vector<std::string> parts;
  while (size >= 2) {
    const size_t length = std::min(data[0] + size_t{256} * data[1], size - 2);
    parts.emplace_back(reinterpret_cast<const char*>(data) + 2, length);
    data += 2 + length;
    size -= 2 + length;
  }
  return parts;
}

/// One call.
class Peer {
 public:
  grpc::Status send(grpc::GenericStub& stub, const char* method, const std::vector<std::string>& messages) {
    const auto call = stub.PrepareCall(&context_, method, &queue_);
    call->StartCall(this);
    bool open = wait();
    for (size_t i = 0; i < messages.size() && open; ++i) {
      const grpc::Slice slice(messages[i]);
      call->Write(grpc::ByteBuffer(&slice, 1), this);
      open = wait();
    }
    if (open) {
      call->WritesDone(this);
      wait();
    }
    grpc::ByteBuffer answer;
    call->Read(&answer, this);
    if (wait()) context_.TryCancel();
    grpc::Status status;
    call->Finish(&status, this);
    wait();
    queue_.Shutdown();
    return status;
  }

 private:
  bool wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }
  grpc::CompletionQueue queue_;
  grpc::ClientContext context_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  testing::FuzzedCoordinator c;
  c.wanted.look_around();  // the job's scene was never uploaded, so it is wanted
  grpc::ServerBuilder builder;
  builder.RegisterService(&c.client);
  builder.RegisterService(&c.worker);
  int port = 0;  // gRPC's transport within a process loses calls whose first message is none
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  grpc::GenericStub stub(
      grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()));

  const Method& method = kMethods[data[0] % std::size(kMethods)];
  std::vector<std::string> messages = split(data + 1, size - 1);
  for (std::string& message : messages) message = method.as_worker(c.me, message);
  testing::check_status(Peer().send(stub, method.name, messages));
  c.client.stop();
  c.worker.stop();
  server->Shutdown();
  return 0;
}
