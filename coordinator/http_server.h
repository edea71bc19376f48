#pragma once
// The coordinator's HTTP side: /healthz, /metrics and a plain status page at /.
#include <memory>
#include <string>

#include "common/rpc/security.h"
#include "coordinator/authenticator.h"
#include "coordinator/farm.h"

namespace lightmill {

/// HTTPS and roles, or plain text and everybody if both are empty. A token comes as "Authorization: Bearer
/// TOKEN", or from browsers as the password of any user.
struct HttpSecurity {
  SecurityFiles files{};  // resolved; of the certificate and its key, which are read at every connection
  std::shared_ptr<Authenticator> authenticator{};
};

class HttpServer {
 public:
  /// Binds HOST:PORT (port 0: any) and serves from a thread of its own. Throws Error(kFailed) if the address
  /// can't be bound. `farm` must outlive the server.
  HttpServer(const std::string& address, const Farm& farm, const HttpSecurity& security = {});
  ~HttpServer();
  int port() const { return port_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  int port_ = 0;
};

/// The status page: jobs and workers as tables, refreshed every few seconds. Names are escaped.
std::string status_page(const Farm& farm);

}  // namespace lightmill
