#pragma once
// Keeps an HTTP server's threads from peers that connect and bring no request, or one a byte at a time: the
// library bounds each single read, so that such a peer has a thread for as long as it likes.
//
//   HttpWatch watch(server);                 // before it listens; set_logger is taken by this
//   server.set_pre_routing_handler([&](const auto& request, auto& response) { watch.began(request); ... });
//   watch.start(port);
#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_set>

namespace httplib {
class Server;
struct Request;
}  // namespace httplib

namespace lightmill {

/// A connection that is not being served is closed after kMostSilentSeconds, and sooner the longer it is
/// silent where there are more than kMostSilent of them. One whose request has arrived is left alone.
/// Thread-safe.
class HttpWatch {
 public:
  static constexpr double kMostSilentSeconds = 15, kGraceSeconds = 1;
  static constexpr size_t kMostSilent = 24;

  explicit HttpWatch(httplib::Server& server);
  ~HttpWatch();
  HttpWatch(const HttpWatch&) = delete;
  HttpWatch& operator=(const HttpWatch&) = delete;
  /// Looks once a second at the connections to this port of the process.
  void start(int port);
  /// The head of a request has arrived; its end is heard of by the server's logger.
  void began(const httplib::Request& request);

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Connection {
    Time since;  // of silence
    bool serving = false;
    uint64_t seen = 0;  // by which look
    int fd = -1;        // at that look
    ino_t inode = 0;
  };
  void ended(const httplib::Request& request);
  void look();
  void find_connections(Time now);
  /// Shuts it down, if the descriptor is still that connection's.
  static void close(const Connection& connection);

  std::mutex mutex_;
  std::condition_variable ending_;
  // Guarded by mutex_.
  std::map<std::string, Connection> connections_;  // by the peer's address and port
  std::unordered_set<ino_t> others_;               // sockets that have nothing to do with the port
  uint64_t looks_ = 0;
  int port_ = 0;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace lightmill
