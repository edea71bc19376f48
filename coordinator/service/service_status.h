#pragma once
// The error policy of the services: an exception of a handler becomes a status, and none leaves a handler.
#include <grpcpp/support/status.h>

#include <new>
#include <stdexcept>

#include "common/rpc/status.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/job_store.h"

namespace lightmill {

/// A status that no Error stands for.
struct StatusError : std::runtime_error {
  explicit StatusError(const grpc::Status& status)
      : std::runtime_error(status.error_message()), status(status) {}
  grpc::Status status;
};

/// Runs a handler that returns a grpc::Status.
template <class Handler>
grpc::Status guarded(Handler&& handler) {
  try {
    return handler();
  } catch (const StatusError& e) {
    return e.status;
  } catch (const UnknownJob& e) {
    return {grpc::StatusCode::NOT_FOUND, one_line(e.what())};
  } catch (const UnknownSequence& e) {
    return {grpc::StatusCode::NOT_FOUND, one_line(e.what())};
  } catch (const UnknownWorker& e) {
    return {grpc::StatusCode::NOT_FOUND, one_line(e.what())};
  } catch (const LimitReached& e) {
    return {grpc::StatusCode::RESOURCE_EXHAUSTED, one_line(e.what())};
  } catch (const StoreError& e) {
    return {grpc::StatusCode::INTERNAL, one_line(e.what())};
  } catch (const Error& e) {
    return to_status(e);
  } catch (const std::bad_alloc&) {
    return {grpc::StatusCode::RESOURCE_EXHAUSTED, "the coordinator is out of memory"};
  } catch (const std::exception& e) {
    return {grpc::StatusCode::INTERNAL, one_line(e.what())};
  }
}

}  // namespace lightmill
