#pragma once
// Bounds the calls that one connection may have at a time. gRPC states a bound in HTTP/2's settings, but
// holds only those peers to it that have acknowledged them. This counts the calls of the others, too, and
// cancels those beyond. A call that its peer has given up counts until its handler has noticed, so this bound
// should be above that of the settings.
#include <grpcpp/support/server_interceptor.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace lightmill {

/// Calls in progress, by the peer's address and port. Thread-safe.
class StreamCounts {
 public:
  explicit StreamCounts(int most) : most_(most) {}
  /// Every call enters and leaves. enter() returns false if it is one too many.
  bool enter(const std::string& peer);
  void leave(const std::string& peer);

 private:
  const int most_;
  std::mutex mutex_;
  std::map<std::string, int> calls_;
};

class StreamLimit final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit StreamLimit(int most) : counts_(std::make_shared<StreamCounts>(most)) {}
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override;

 private:
  const std::shared_ptr<StreamCounts> counts_;  // calls may end after the server
};

}  // namespace lightmill
