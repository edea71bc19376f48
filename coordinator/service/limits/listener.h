#pragma once
// Listens on the gRPC port. Connections beyond a number or a rate are closed before anything is read of them.
// gRPC itself would take all, and stops listening for good when file descriptors run out.
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace lightmill {

struct ListenerOptions {
  std::string address;  // HOST:PORT, port 0: any
  int max_connections = 10000;
  double connections_per_second = 200;  // of one address
  double burst = 1000;
};

class Listener {
 public:
  /// Listens on all addresses of the host. Throws Error(kUsage) for a malformed address, Error(kFailed) if it
  /// can't be bound. Raises the process's limit of open files as far as is allowed.
  explicit Listener(const ListenerOptions& options);
  /// Stops accepting.
  ~Listener();
  int port() const;
  /// Starts to accept: `hand` gets each connection's descriptor and owns it.
  void open(std::function<void(int fd)> hand);
  /// Connections that were turned away.
  uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
