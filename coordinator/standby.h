#pragma once
// What a coordinator shows while another one leads the farm: gRPC's health says NOT_SERVING, every call and
// every page is answered at once with a line that says who leads (UNAVAILABLE, 503), so that workers and
// clients go there. /livez and /metrics are answered as ever, the latter by a gauge that says that it stands
// by: nobody should take it for dead. No token is asked for, as nothing is told but that address.
#include <memory>
#include <string>

#include "coordinator/server.h"

namespace lightmill {

class Standby {
 public:
  /// Listens where the server of these options would. Throws what that throws.
  explicit Standby(const ServerOptions& options);
  ~Standby();
  /// Address of the coordinator that leads; empty: not known.
  void set_leader(const std::string& address);
  int rpc_port() const;
  /// 0 without HTTP.
  int http_port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
