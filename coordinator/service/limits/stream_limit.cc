#include "coordinator/service/limits/stream_limit.h"

#include <grpcpp/server_context.h>

#include <utility>

namespace lightmill {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;

/// Lives as long as its call.
class CountedCall final : public grpc::experimental::Interceptor {
 public:
  CountedCall(std::shared_ptr<StreamCounts> counts, ServerRpcInfo* info)
      : counts_(std::move(counts)), info_(info) {}
  ~CountedCall() override {
    if (counted_) counts_->leave(peer_);
  }
  void Intercept(InterceptorBatchMethods* methods) override {
    if (!counted_ &&
        methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      peer_ = info_->server_context()->peer();
      counted_ = true;
      if (!counts_->enter(peer_)) info_->server_context()->TryCancel();
    }
    methods->Proceed();
  }

 private:
  const std::shared_ptr<StreamCounts> counts_;
  ServerRpcInfo* const info_;
  std::string peer_;
  bool counted_ = false;
};

}  // namespace

bool StreamCounts::enter(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  return ++calls_[peer] <= most_;
}

void StreamCounts::leave(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  const auto found = calls_.find(peer);
  if (--found->second == 0) calls_.erase(found);
}

grpc::experimental::Interceptor* StreamLimit::CreateServerInterceptor(ServerRpcInfo* info) {
  return new CountedCall(counts_, info);
}

}  // namespace lightmill
