#include "client/connection/farm_connection.h"

#include "common/base/error.h"
#include "common/rpc/status.h"
#include "common/rpc/tls_diagnosis.h"

namespace lightmill::client {
namespace {

constexpr double kLookSeconds = 3;  // whether a coordinator is there, and leads

}  // namespace

FarmConnection::FarmConnection(const ConnectionOptions& connection)
    : coordinators_(connection.coordinator),
      security_(resolve(connection.security, Side::kClient)),
      insecure_(connection.insecure) {
  connect_anew();
}

void FarmConnection::connect_anew() {
  const std::lock_guard lock(mutex_);
  stubs_.clear();  // channels to one address share what they wait for as long as one is there
  for (size_t i = 0; i < coordinators_.size(); ++i) {
    const auto channel = make_channel({coordinators_.address(i), insecure_, security_});
    stubs_.push_back({v1::ClientService::NewStub(channel), v1::SequenceService::NewStub(channel)});
  }
  met_ = false;
}

FarmConnection::Stubs FarmConnection::stubs_of(size_t coordinator) const {
  const std::lock_guard lock(mutex_);
  return stubs_[coordinator];
}

FarmConnection::Stubs FarmConnection::stubs() {
  if (!met_) find_leader();
  return stubs_of(coordinators_.current());
}

/// A call that changes nothing tells who leads: calls that do must not be repeated elsewhere.
void FarmConnection::find_leader() {
  for (size_t tries = 0; coordinators_.size() > 1 && tries < coordinators_.size(); ++tries) {
    const size_t current = coordinators_.current();
    grpc::ClientContext context;
    set_deadline(context, kLookSeconds);
    v1::GetJobResponse response;
    const grpc::Status status = stubs_of(current).client->GetJob(&context, v1::GetJobRequest(), &response);
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
