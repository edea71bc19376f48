#include "coordinator/http/http_server.h"

#include <httplib.h>

#include <atomic>
#include <ctime>
#include <thread>

#include "coordinator/http/http_base.h"
#include "coordinator/http/http_watch.h"
#include "coordinator/http/metrics.h"

namespace lightmill {
namespace {

/// Threads beside those of the streams. Connections that are kept alive hold theirs for a moment.
constexpr size_t kOtherThreads = 32;
constexpr time_t kKeepAliveSeconds = 2;

using Handled = httplib::Server::HandlerResponse;

/// Answers for those who may not come in.
Handled judge(Authenticator& authenticator, const httplib::Request& request, httplib::Response& response) {
  const Verdict verdict =
      authenticator.judge(request.path, request.get_header_value("Authorization"), std::time(nullptr));
  if (verdict.kind == Verdict::Kind::kAllowed) return Handled::Unhandled;
  if (verdict.kind == Verdict::Kind::kUnauthenticated) {
    response.status = 401;
    response.set_header("WWW-Authenticate", "Basic realm=\"Lightmill: any user, a token as the password\"");
  } else {
    response.status = access_rule(request.path) ? 403 : 404;
  }
  response.set_content(verdict.message + "\n", "text/plain");
  return Handled::Handled;
}

/// Refuses what would cost more than it asks for: a body of unknown length, which ends when the peer likes,
/// and several ranges, which may name the same bytes again and again.
Handled bound(const httplib::Request& request, httplib::Response& response) {
  if (request.ranges.size() > 1) {
    response.status = 416;
    response.set_content("one range at a time\n", "text/plain");
    return Handled::Handled;
  }
  const bool has_body = request.method == "POST" || request.method == "PUT" || request.method == "PATCH";
  if (has_body && !request.has_header("Content-Length")) {
    response.status = 411;
    response.set_header("Connection", "close");
    response.set_content("give a Content-Length\n", "text/plain");
    return Handled::Handled;
  }
  return Handled::Unhandled;
}

}  // namespace

struct HttpServer::Impl {
  Impl(const SecurityFiles& security, const WebOptions& web)
      : files(security), api(web), server(make_http_server(files)), watch(*server) {}
  const SecurityFiles files;
  WebApi api;
  const std::unique_ptr<httplib::Server> server;
  HttpWatch watch;
  std::atomic<bool> ended{false};  // the listening loop, whyever
  std::thread thread;
};

HttpServer::HttpServer(const std::string& address, const WebOptions& web, const Metrics& metrics,
                       const SecurityFiles& files)
    : impl_(std::make_unique<Impl>(files, web)) {
  httplib::Server& server = *impl_->server;
  server.new_task_queue = [] { return new httplib::ThreadPool(WebApi::kMaxStreams + kOtherThreads); };
  server.set_keep_alive_timeout(kKeepAliveSeconds);
  server.set_tcp_nodelay(true);
  server.set_read_timeout(5);
  server.set_write_timeout(5);
  server.set_payload_max_length(WebApi::kMaxBody);
  server.set_pre_routing_handler([&watch = impl_->watch, judges = web.authenticator](
                                     const httplib::Request& request, httplib::Response& response) {
    watch.began(request);
    if (bound(request, response) == Handled::Handled) return Handled::Handled;
    return judges ? judge(*judges, request, response) : Handled::Unhandled;
  });
  for (const char* probe : {"/healthz", "/livez"}) {
    server.Get(probe, [](const httplib::Request&, httplib::Response& response) {
      response.set_content("ok\n", "text/plain");
    });
  }
  server.Get("/metrics", [&metrics](const httplib::Request&, httplib::Response& response) {
    response.set_content(metrics.text(), kMetricsType);
  });
  impl_->api.install(server);
  port_ = bind_http(server, address);
  impl_->watch.start(port_);
  impl_->thread = std::thread([this] {
    impl_->server->listen_after_bind();
    impl_->ended = true;
  });
}

HttpServer::~HttpServer() {
  // stop() does nothing before the thread has begun to listen.
  while (!impl_->server->is_running() && !impl_->ended) std::this_thread::yield();
  impl_->api.stop();
  impl_->server->stop();
  impl_->thread.join();
}

}  // namespace lightmill
