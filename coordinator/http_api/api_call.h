#pragma once
// A call of an RPC of this process's own gRPC server, by name and with bytes: the way of the HTTP API to the
// handlers. So the bounds and the errors of gRPC hold for it, too. Tokens do not: whoever calls has judged
// them.
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

namespace lightmill {

class ApiCall;

/// The calls under way, so that they can be ended. Thread-safe; outlives its calls.
class ApiCalls {
 public:
  explicit ApiCalls(std::shared_ptr<grpc::Channel> channel) : channel_(std::move(channel)) {}
  /// Cancels all, and those that come later.
  void stop();

 private:
  friend class ApiCall;
  const std::shared_ptr<grpc::Channel> channel_;
  std::mutex mutex_;
  std::set<ApiCall*> calls_;  // guarded by mutex_
  bool stopped_ = false;      // guarded by mutex_
};

/// One call with one request. Its methods block; it belongs to one thread at a time.
class ApiCall {
 public:
  /// `authorization`: the header's text, for handlers that ask who calls; may be empty. It must be printable
  /// ASCII.
  ApiCall(ApiCalls& calls, const std::string& rpc, const std::string& authorization, double deadline_seconds,
          const std::string& request);
  /// Cancels what has not ended.
  ~ApiCall();
  ApiCall(const ApiCall&) = delete;
  ApiCall& operator=(const ApiCall&) = delete;
  /// The next message; false: there is none any more.
  bool read(std::string* message);
  /// How the call ended, once read() has returned false.
  grpc::Status finish();

 private:
  friend class ApiCalls;
  /// Waits for what was begun last. False if it did not go through.
  bool done();

  ApiCalls& calls_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
  std::optional<grpc::Status> status_;
};

}  // namespace lightmill
