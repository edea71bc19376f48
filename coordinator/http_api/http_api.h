#pragma once
// The HTTP API: every RPC with the option `http` (proto/lightmill/v1/http.proto) at its path below /v1, and
// their OpenAPI description at /v1/openapi.json. docs/http-api.md is for its users.
//
// It knows no RPC by name. A request is judged by the RPC's roles, turned into the RPC's message, and sent to
// this process's own gRPC server, so that an RPC has the same handler, bounds and errors either way. What
// HTTP adds is bounded here: bodies before they are read, calls of one caller, bytes of all answers, peers
// that are slow.
#include <memory>
#include <string>

#include "coordinator/access/authenticator.h"
#include "coordinator/service/limits/submit_limit.h"

namespace grpc {
class Channel;
}
namespace httplib {
class Server;
struct Request;
}  // namespace httplib

namespace lightmill {

struct HttpApiOptions {
  std::shared_ptr<grpc::Channel> channel;  // to this process's server (InProcessChannel); null: no API
  std::shared_ptr<Authenticator> authenticator{};  // null: everybody may do everything
  std::shared_ptr<SubmitLimit> submissions{};      // counts by token where there are tokens; may be null
  bool loopback_only = false;                      // plain text: other sites' names are refused (web/guard.h)
};

class HttpApi {
 public:
  /// Calls at a time, each with a thread of the server; and of one token, or of one address without tokens.
  static constexpr int kMaxCalls = 96, kMaxCallsOfCaller = 48;

  explicit HttpApi(const HttpApiOptions& options);
  ~HttpApi();
  /// Adds the routes; `server` must not serve any more when this object goes.
  void install(httplib::Server& server);
  /// Ends the calls under way.
  void stop();
  /// Whether a path is one of this API, which judges itself who may have it.
  static bool serves(const std::string& path) { return path.starts_with("/v1/"); }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
