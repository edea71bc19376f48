// Every request of both services: the first byte chooses the RPC, the rest is its message, read as a server
// reads it. Unary RPCs run their handlers over a farm in memory; of streams the messages are validated as
// their handlers do. A message that names any worker is of the one that has a lease.
#include <google/protobuf/message.h>

#include "common/base/error.h"
#include "common/rpc/convert.h"
#include "common/rpc/request_limits.h"
#include "coordinator/service/client_service.h"
#include "coordinator/service/worker_service.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace {

using namespace lightmill;

struct Coordinator {
  testing::TemporaryFolder folder;
  BlobStore blobs{folder.file("blobs")};
  FakeClock clock;
  Farm farm{std::make_unique<MemoryJobStore>(), clock, testing::fake_options()};
  Metrics metrics{farm};
  TileLog tile_log;
  StallWatch stalls{clock, 60, false};
  ClientService client{farm, blobs, tile_log, stalls, Quotas{}, nullptr};
  WorkerService worker{farm, blobs, metrics, tile_log, stalls, Quotas{}, 10};
  JobId job = farm.submit(testing::small_job(64, 33, 8));
  std::string me = enter();  // as the worker calls itself

  std::string enter() {
    v1::RegisterRequest request;
    *request.mutable_registration() = to_proto(testing::registration());
    v1::RegisterResponse response;
    grpc::ServerContext context;
    if (!worker.Register(&context, &request, &response).ok()) abort();
    farm.lease(WorkerKeys::shown(response.worker_id()));
    return response.worker_id();
  }
};

template <class T>
T parsed(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  grpc::ByteBuffer buffer(&slice, 1);
  T message;
  if (!read_message(&buffer, &message).ok()) message.Clear();
  return message;
}

/// Puts the right name where there is one.
template <class T>
void name_worker(const std::string& name, T* message) {
  if constexpr (requires { message->set_worker_id(name); }) {
    if (!message->worker_id().empty()) message->set_worker_id(name);
  }
}

/// A unary handler. Its answer must be a status of a line.
template <class Service, class Request, class Response>
void call(const Coordinator& c, Service& service,
          grpc::Status (Service::*handler)(grpc::ServerContext*, const Request*, Response*),
          const std::string& bytes) {
  auto request = parsed<Request>(bytes);
  name_worker(c.me, &request);
  Response response;
  grpc::ServerContext context;  // of a call without metadata
  const grpc::Status status = (service.*handler)(&context, &request, &response);
  if (status.error_message().find('\n') != std::string::npos) abort();
  if (status.error_code() == grpc::StatusCode::INTERNAL) abort();
}

template <class F>
void tried(F&& f) {
  try {
    f();
  } catch (const Error&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  Coordinator c;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 20) {
    case 0:
      call(c, c.client, &ClientService::SubmitJob, bytes);
      break;
    case 1:
      call(c, c.client, &ClientService::GetJob, bytes);
      break;
    case 2:
      call(c, c.client, &ClientService::ListJobs, bytes);
      break;
    case 3:
      call(c, c.client, &ClientService::ListWorkers, bytes);
      break;
    case 4:
      call(c, c.client, &ClientService::PauseJob, bytes);
      break;
    case 5:
      call(c, c.client, &ClientService::ResumeJob, bytes);
      break;
    case 6:
      call(c, c.client, &ClientService::CancelJob, bytes);
      break;
    case 7:
      call(c, c.client, &ClientService::RetryJob, bytes);
      break;
    case 8:
      call(c, c.client, &ClientService::ExtendJob, bytes);
      break;
    case 9:
      call(c, c.client, &ClientService::GetCurve, bytes);
      break;
    case 10:
      call(c, c.client, &ClientService::FindMissingBlobs, bytes);
      break;
    case 11:
      call(c, c.worker, &WorkerService::Register, bytes);
      break;
    case 12:
      call(c, c.worker, &WorkerService::Renew, bytes);
      break;
    case 13:
      call(c, c.worker, &WorkerService::Fail, bytes);
      call(c, c.worker, &WorkerService::Warn, bytes);  // fields of the same kinds
      break;
    case 14:
      call(c, c.worker, &WorkerService::Drain, bytes);
      break;
    case 15:
      call(c, c.worker, &WorkerService::GetBundle, bytes);
      break;
    case 16:
      tried([&] {
        const auto message = parsed<v1::UploadBlobsRequest>(bytes);
        auto writer = c.blobs.begin(message.header().digest(), message.header().size());
        writer.write(message.chunk());
        writer.finish();
      });
      break;
    case 17:
      tried([&] {
        const auto message = parsed<v1::CommitRequest>(bytes);
        const LeaseKey key = from_proto(message.header().key());
        c.farm.max_partial_bytes(key);
        c.farm.commit(WorkerKeys::shown(c.me), key, message.header().digest());
      });
      break;
    case 18:  // what a coordinator sends to a worker
      tried([&] { from_proto(parsed<v1::LeaseGrant>(bytes)); });
      break;
    default:  // and to a client
      tried([&] { from_proto(parsed<v1::JobStatus>(bytes)); });
      tried([&] { from_proto(parsed<v1::TileStatus>(bytes)); });
      tried([&] { from_proto(parsed<v1::ErrorCurve>(bytes)); });
  }
  return 0;
}
