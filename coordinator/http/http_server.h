#pragma once
// The coordinator's HTTP side: /healthz and /livez, /metrics, the dashboard (coordinator/web/web_api.h) and
// the API (coordinator/http_api/http_api.h).
#include <memory>
#include <string>

#include "common/rpc/security.h"
#include "coordinator/http/metrics.h"
#include "coordinator/web/web_api.h"

namespace lightmill {

/// HTTPS if there are `files`, read at every connection; roles if `web` has an authenticator. A token comes
/// as "Authorization: Bearer TOKEN", or from browsers as the password of any user.
class HttpServer {
 public:
  /// Binds HOST:PORT (port 0: any) and serves from threads of its own. Throws Error(kFailed) if the address
  /// can't be bound. What `web` refers to, `metrics`, and the server that `rpc` leads to must outlive this.
  HttpServer(const std::string& address, const WebOptions& web, const Metrics& metrics,
             const SecurityFiles& files, std::shared_ptr<grpc::Channel> rpc);
  ~HttpServer();
  int port() const { return port_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  int port_ = 0;
};

}  // namespace lightmill
