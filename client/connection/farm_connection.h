#pragma once
// A client's way to the coordinator that leads: one stub to each address, and calls with deadlines. Errors
// are those of FarmClient (farm_client.h).
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/options.h"
#include "common/rpc/channel.h"
#include "common/rpc/coordinators.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/sequence.grpc.pb.h"

namespace lightmill::client {

inline constexpr double kTransferSeconds = 3600;  // uploads, images, long lists

/// Thread-safe.
class FarmConnection {
 public:
  using Stub = v1::ClientService::Stub;
  using SequenceStub = v1::SequenceService::Stub;

  /// Does not connect yet. Throws what the constructor of FarmClient throws.
  explicit FarmConnection(const ConnectionOptions& connection);

  const std::string& address() const { return coordinators_.address(coordinators_.current()); }
  const SecurityFiles& security() const { return security_; }
  /// Of the one to call; of several, one that leads if any does.
  std::shared_ptr<Stub> stub() { return stubs().client; }
  std::shared_ptr<SequenceStub> sequences() { return stubs().sequences; }
  /// The next stub() connects at once: after a failure gRPC lets seconds pass until it tries again, in which
  /// every call fails.
  void connect_anew();
  /// Throws what a status means. If nobody could be reached, TLS may be why; gRPC does not say.
  void require_ok(const grpc::Status& status) const;

  template <class Request, class Response>
  Response call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
    return call_within<Response>(kFirstAnswerSeconds, *stub(), method, request);
  }
  /// The same; a change of many frames takes its time.
  template <class Request, class Response>
  Response call(grpc::Status (SequenceStub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request, double seconds = kFirstAnswerSeconds) {
    return call_within<Response>(seconds, *sequences(), method, request);
  }

 private:
  static constexpr double kFirstAnswerSeconds = 8;  // "is anybody there?" within a few seconds
  struct Stubs {
    std::shared_ptr<Stub> client;
    std::shared_ptr<SequenceStub> sequences;
  };

  template <class Response, class Service, class Method, class Request>
  Response call_within(double seconds, Service& service, Method method, const Request& request) {
    grpc::ClientContext context;
    set_deadline(context, seconds);
    Response response;
    require_ok((service.*method)(&context, request, &response));
    return response;
  }
  Stubs stubs();
  void find_leader();
  Stubs stubs_of(size_t coordinator) const;

  Coordinators coordinators_;
  SecurityFiles security_;
  bool insecure_ = false;
  mutable std::mutex mutex_;
  std::vector<Stubs> stubs_;       // guarded by mutex_; one to a coordinator
  std::atomic<bool> met_ = false;  // one that leads was found
};

}  // namespace lightmill::client
