#pragma once
// lightmill::Error <-> grpc::Status, so that a refusal reads the same in the process and across the wire.
//
//   server:  catch (const Error& e) { return to_status(e); }
//   client:  throw_if_failed(stub->GetJob(&context, request, &reply), "127.0.0.1:7070");
#include <grpcpp/support/status.h>

#include <exception>
#include <string>

#include "common/base/error.h"

namespace lightmill {

/// kUsage, kBadScene -> INVALID_ARGUMENT; kUnreachable (a refusal) -> PERMISSION_DENIED; kFailed ->
/// FAILED_PRECONDITION. The message is kept, cut to one line of at most 1000 bytes.
grpc::Status to_status(const Error& error);

/// UNAVAILABLE, DEADLINE_EXCEEDED, UNAUTHENTICATED, PERMISSION_DENIED, RESOURCE_EXHAUSTED, UNIMPLEMENTED ->
/// kUnreachable; INVALID_ARGUMENT, OUT_OF_RANGE -> kUsage; all others -> kFailed. One line; where the peer
/// could not be reached it names `address` and says how to mend it.
Error to_error(const grpc::Status& status, const std::string& address);

/// Throws to_error(...) unless the status is OK.
void throw_if_failed(const grpc::Status& status, const std::string& address);

/// First line of a text, at most 1000 bytes, valid UTF-8 without control characters (common/base/utf8.h).
std::string one_line(const std::string& text);

}  // namespace lightmill
