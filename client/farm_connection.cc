#include "client/farm_connection.h"

#include "common/error.h"
#include "common/rpc/status.h"
#include "common/rpc/tls_diagnosis.h"

namespace lightmill::client {
namespace {

constexpr double kLookSeconds = 3;  // whether a coordinator is there, and leads

}  // namespace

FarmConnection::FarmConnection(const ConnectionOptions& connection)
    : coordinators_(connection.coordinator), security_(resolve(connection.security, Side::kClient)) {
  for (size_t i = 0; i < coordinators_.size(); ++i) {
    stubs_.push_back(
        v1::ClientService::NewStub(make_channel({coordinators_.address(i), connection.insecure, security_})));
  }
}

FarmConnection::Stub* FarmConnection::stub() {
  if (!met_) find_leader();
  return stubs_[coordinators_.current()].get();
}

/// A call that changes nothing tells who leads: calls that do must not be repeated elsewhere.
void FarmConnection::find_leader() {
  for (size_t tries = 0; coordinators_.size() > 1 && tries < coordinators_.size(); ++tries) {
    const size_t current = coordinators_.current();
    grpc::ClientContext context;
    set_deadline(context, kLookSeconds);
    v1::GetJobResponse response;
    const grpc::Status status = stubs_[current]->GetJob(&context, v1::GetJobRequest(), &response);
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE &&
        status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) {
      break;
    }
    coordinators_.move_on(current);
  }
  met_ = true;
}

void FarmConnection::require_ok(const grpc::Status& status) const {
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    const std::string problem = diagnose_tls(address(), security_).problem;
    if (!problem.empty()) throw Error(ErrorKind::kUnreachable, "coordinator " + address() + ": " + problem);
  }
  throw_if_failed(status, address());
}

}  // namespace lightmill::client
