#pragma once
// How gRPC's statuses look over HTTP: the code as google.rpc.Code has it, and the body of a
// google.rpc.Status.
#include <grpcpp/support/status.h>

#include <string>

namespace lightmill {

/// 200 for OK, 400 for INVALID_ARGUMENT, FAILED_PRECONDITION and OUT_OF_RANGE, 401, 403, 404, 409, 429, 499,
/// 500, 501, 503, 504 for the others.
int http_status(grpc::StatusCode code);

/// {"code": 5, "message": "…", "details": []}. The message is one line.
std::string error_json(const grpc::Status& status);

}  // namespace lightmill
