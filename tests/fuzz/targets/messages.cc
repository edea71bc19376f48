// Every request of both services: the first byte chooses the RPC, the rest is its message, read as a server
// reads it, and its handler runs over a farm in memory. A message that names any worker is of the one that
// has a lease. Streams and the other callbacks have a target of their own.
#include <google/protobuf/message.h>

#include "common/base/error.h"
#include "tests/fuzz/targets/coordinator.h"

namespace {

using namespace lightmill;

using testing::parsed;

/// Puts the right name where there is one.
template <class T>
void name_worker(const std::string& name, T* message) {
  if constexpr (requires { message->set_worker_id(name); }) {
    if (!message->worker_id().empty()) message->set_worker_id(name);
  }
}

/// A unary handler. Its answer must be a status of a line.
template <class Service, class Request, class Response>
void call(const testing::FuzzedCoordinator& c, Service& service,
          grpc::Status (Service::*handler)(grpc::ServerContext*, const Request*, Response*),
          const std::string& bytes) {
  auto request = parsed<Request>(bytes);
  name_worker(c.me, &request);
  Response response;
  grpc::ServerContext context;  // of a call without metadata
  const grpc::Status status = (service.*handler)(&context, &request, &response);
  testing::check_status(status);
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
  testing::FuzzedCoordinator c;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 18) {
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
      call(c, c.worker, &WorkerService::ShowPicture, bytes);
      break;
    case 14:
      call(c, c.worker, &WorkerService::Drain, bytes);
      break;
    case 15:
      call(c, c.worker, &WorkerService::GetBundle, bytes);
      break;
    case 16:  // what a coordinator sends to a worker
      tried([&] { from_proto(parsed<v1::LeaseGrant>(bytes)); });
      break;
    default:  // and to a client
      tried([&] { from_proto(parsed<v1::JobStatus>(bytes)); });
      tried([&] { from_proto(parsed<v1::TileStatus>(bytes)); });
      tried([&] { from_proto(parsed<v1::ErrorCurve>(bytes)); });
  }
  return 0;
}
