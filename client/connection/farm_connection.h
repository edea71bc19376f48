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

namespace lightmill::client {

inline constexpr double kTransferSeconds = 3600;  // uploads, images, long lists

/// Thread-safe.
class FarmConnection {
 public:
  using Stub = v1::ClientService::Stub;

  /// Does not connect yet. Throws what the constructor of FarmClient throws.
  explicit FarmConnection(const ConnectionOptions& connection);

  const std::string& address() const { return coordinators_.address(coordinators_.current()); }
  const SecurityFiles& security() const { return security_; }
  /// Of the one to call; of several, one that leads if any does.
  std::shared_ptr<Stub> stub();
  /// The next stub() connects at once: after a failure gRPC lets seconds pass until it tries again, in which
  /// every call fails.
  void connect_anew();
  /// Throws what a status means. If nobody could be reached, TLS may be why; gRPC does not say.
  void require_ok(const grpc::Status& status) const;

  template <class Request, class Response>
  Response call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
    const std::shared_ptr<Stub> leader = stub();
    grpc::ClientContext context;
    set_deadline(context, kFirstAnswerSeconds);
    Response response;
    require_ok(((*leader).*method)(&context, request, &response));
    return response;
  }

 private:
  static constexpr double kFirstAnswerSeconds = 8;  // "is anybody there?" within a few seconds

  void find_leader();
  std::shared_ptr<Stub> stub_of(size_t coordinator) const;

  Coordinators coordinators_;
  SecurityFiles security_;
  bool insecure_ = false;
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<Stub>> stubs_;  // guarded by mutex_; one to a coordinator
  std::atomic<bool> met_ = false;             // one that leads was found
};

}  // namespace lightmill::client
