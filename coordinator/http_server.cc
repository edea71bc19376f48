#include "coordinator/http_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <thread>

#include "common/rpc/channel.h"
#include "coordinator/metrics.h"

namespace lightmill {

struct HttpServer::Impl {
  httplib::Server server;
  std::atomic<bool> ended{false};  // the listening loop, whyever
  std::thread thread;
};

HttpServer::HttpServer(const std::string& address, const Farm& farm) : impl_(std::make_unique<Impl>()) {
  const HostPort at = parse_address(address);
  httplib::Server& server = impl_->server;
  // The library's default lets a second process share the port; here that is an error.
  server.set_socket_options([](int socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.new_task_queue = [] { return new httplib::ThreadPool(4); };
  server.set_read_timeout(5);
  server.set_write_timeout(5);
  server.set_payload_max_length(1 << 16);
  server.Get("/healthz", [](const httplib::Request&, httplib::Response& response) {
    response.set_content("ok\n", "text/plain");
  });
  server.Get("/metrics", [&farm](const httplib::Request&, httplib::Response& response) {
    response.set_content(metrics_text(farm), "text/plain; version=0.0.4");
  });
  server.Get("/", [&farm](const httplib::Request&, httplib::Response& response) {
    response.set_content(status_page(farm), "text/html; charset=utf-8");
  });
  if (at.port == 0) {
    port_ = server.bind_to_any_port(at.host.c_str());
  } else if (server.bind_to_port(at.host.c_str(), at.port)) {
    port_ = at.port;
  }
  if (port_ <= 0) {
    throw Error(ErrorKind::kFailed, "--http " + address + ": can't listen there; is the port in use?");
  }
  impl_->thread = std::thread([this] {
    impl_->server.listen_after_bind();
    impl_->ended = true;
  });
}

HttpServer::~HttpServer() {
  // stop() does nothing before the thread has begun to listen.
  while (!impl_->server.is_running() && !impl_->ended) std::this_thread::yield();
  impl_->server.stop();
  impl_->thread.join();
}

}  // namespace lightmill
