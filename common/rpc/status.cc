#include "common/rpc/status.h"

#include "common/base/utf8.h"

namespace lightmill {
namespace {

constexpr size_t kMaxMessage = 1000;

grpc::StatusCode code_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
    case ErrorKind::kBadScene:
      return grpc::StatusCode::INVALID_ARGUMENT;
    case ErrorKind::kUnreachable:
      return grpc::StatusCode::PERMISSION_DENIED;
    case ErrorKind::kFailed:
      break;
  }
  return grpc::StatusCode::FAILED_PRECONDITION;
}

}  // namespace

std::string one_line(const std::string& text) { return printable_line(text, kMaxMessage); }

grpc::Status to_status(const Error& error) { return {code_of(error.kind()), one_line(error.what())}; }

Error to_error(const grpc::Status& status, const std::string& address) {
  const std::string message = one_line(status.error_message());
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return {ErrorKind::kUnreachable, "coordinator " + address + " can't be reached (" + message +
                                           "); is it running, and is --coordinator right?"};
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return {ErrorKind::kUnreachable, "coordinator " + address + " did not answer in time; try again"};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {ErrorKind::kUnreachable,
              "coordinator " + address + " does not know this request; is it of the same version?"};
    case grpc::StatusCode::UNAUTHENTICATED:
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return {ErrorKind::kUnreachable, "coordinator " + address + " refused: " + message};
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return {ErrorKind::kUsage, message};
    default:
      return {ErrorKind::kFailed, message.empty() ? "coordinator " + address + ": request failed, status " +
                                                        std::to_string(status.error_code())
                                                  : message};
  }
}

void throw_if_failed(const grpc::Status& status, const std::string& address) {
  if (!status.ok()) throw to_error(status, address);
}

}  // namespace lightmill
