#pragma once
// A coordinator over a farm in memory, with one job, and one worker that holds a lease of its first tile.
#include <cstdlib>
#include <string>

#include "common/rpc/convert.h"
#include "common/rpc/request_limits.h"
#include "coordinator/service/client_service.h"
#include "coordinator/service/worker_service.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

struct FuzzedCoordinator {
  TemporaryFolder folder;
  BlobStore blobs{folder.file("blobs")};
  FakeClock clock;
  Farm farm{std::make_unique<MemoryJobStore>(), clock, fake_options()};
  Metrics metrics{farm};
  TileLog tile_log;
  StallWatch stalls{clock, 60, false};
  WantedBlobs wanted{farm, blobs, clock};
  SubmissionGate gate;
  ClientService client{farm, blobs, tile_log, stalls, Quotas{}, gate, nullptr};
  WorkerService worker{farm, blobs, metrics, tile_log, stalls, Quotas{}, 10, {}, &wanted};
  JobId job = farm.submit(small_job(64, 33, 8));
  std::string me = enter();  // as the worker calls itself

  std::string enter() {
    v1::RegisterRequest request;
    *request.mutable_registration() = to_proto(registration());
    v1::RegisterResponse response;
    grpc::ServerContext context;
    if (!worker.Register(&context, &request, &response).ok()) abort();
    farm.lease(WorkerKeys::shown(response.worker_id()));
    return response.worker_id();
  }
};

/// A message as a server reads it; an empty one if it refuses it.
template <class T>
T parsed(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  grpc::ByteBuffer buffer(&slice, 1);
  T message;
  if (!read_message(&buffer, &message).ok()) message.Clear();
  return message;
}

/// What a peer must get, whatever it sends.
inline void check_status(const grpc::Status& status) {
  if (status.error_message().find('\n') != std::string::npos) abort();
  if (status.error_code() == grpc::StatusCode::INTERNAL) abort();
}

}  // namespace lightmill::testing
