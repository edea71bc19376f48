#pragma once
// The client's side of v1.WorkerService.Commit: header and bytes of a partial, with as few packets as there
// can be.
//
//   grpc::ClientContext context;
//   v1::CommitResponse response;
//   grpc::Status status = commit_partial(stub, context, worker, key, bytes, &response);
#include <grpcpp/client_context.h>

#include <string>

#include "common/farm/farm_types.h"
#include "lightmill/v1/worker.grpc.pb.h"

namespace lightmill {

/// Hands in `partial_bytes` in chunks of kChunkBytes. Metadata, header and the first chunk leave together: a
/// small partial is one packet, and wakes the coordinator once.
grpc::Status commit_partial(v1::WorkerService::Stub& stub, grpc::ClientContext& context,
                            const std::string& worker, const LeaseKey& key, const std::string& partial_bytes,
                            v1::CommitResponse* response);

}  // namespace lightmill
