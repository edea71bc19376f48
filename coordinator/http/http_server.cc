#include "coordinator/http/http_server.h"

#include <httplib.h>

#include <atomic>
#include <ctime>
#include <thread>

#include "coordinator/http/http_base.h"
#include "coordinator/http/http_watch.h"
#include "coordinator/http/metrics.h"
#include "coordinator/http_api/http_api.h"
#include "coordinator/http_api/request_body.h"

namespace lightmill {
namespace {

/// Threads beside those of streams and calls. Connections that are kept alive hold theirs for a moment.
constexpr size_t kOtherThreads = 32;
constexpr time_t kKeepAliveSeconds = 2;
constexpr size_t kKeepAliveRequests = 100;  // of a connection: pieces of a file come one after the other

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

Handled refuse_body(httplib::Response& response, int status, const char* why) {
  response.status = status;
  response.set_header("Connection", "close");
  response.set_content(why, "text/plain");
  return Handled::Handled;
}

/// Refuses what would cost more than it asks for: a body of unknown length, which ends when the peer likes,
/// one that grows when it is unpacked, and several ranges, which may name the same bytes again and again.
Handled bound(const httplib::Request& request, httplib::Response& response) {
  if (request.ranges.size() > 1) {
    response.status = 416;
    response.set_content("one range at a time\n", "text/plain");
    return Handled::Handled;
  }
  const bool has_body = request.method == "POST" || request.method == "PUT" || request.method == "PATCH" ||
                        request.method == "DELETE";
  if (!has_body) return Handled::Unhandled;
  // Below /v1 a request without a length has no body, and none is read.
  if (request.has_header("Transfer-Encoding") ||
      (!request.has_header("Content-Length") && !HttpApi::serves(request.path)))
    return refuse_body(response, 411, "give a Content-Length\n");
  if (request.has_header("Content-Encoding"))
    return refuse_body(response, 415, "send the body as it is, without Content-Encoding\n");
  if (!HttpApi::serves(request.path) &&
      request.get_header_value<uint64_t>("Content-Length") > WebApi::kMaxBody)
    return refuse_body(response, 413, "a body may have 1 MiB here\n");
  return Handled::Unhandled;
}

}  // namespace

struct HttpServer::Impl {
  Impl(const SecurityFiles& security, const WebOptions& web, std::shared_ptr<grpc::Channel> rpc)
      : files(security),
        dashboard(web),
        api({std::move(rpc), web.authenticator, web.submissions, web.loopback_only}),
        server(make_http_server(files)),
        watch(*server) {}
  const SecurityFiles files;
  WebApi dashboard;
  HttpApi api;
  const std::unique_ptr<httplib::Server> server;
  HttpWatch watch;
  std::atomic<bool> ended{false};  // the listening loop, whyever
  std::thread thread;
};

HttpServer::HttpServer(const std::string& address, const WebOptions& web, const Metrics& metrics,
                       const SecurityFiles& files, std::shared_ptr<grpc::Channel> rpc)
    : impl_(std::make_unique<Impl>(files, web, std::move(rpc))) {
  httplib::Server& server = *impl_->server;
  server.new_task_queue = [] {
    return new httplib::ThreadPool(WebApi::kMaxStreams + HttpApi::kMaxCalls + kOtherThreads);
  };
  server.set_keep_alive_timeout(kKeepAliveSeconds);
  server.set_keep_alive_max_count(kKeepAliveRequests);
  server.set_tcp_nodelay(true);
  server.set_read_timeout(5);
  server.set_write_timeout(5);
  server.set_payload_max_length(kMaxApiBody);
  server.set_pre_routing_handler([&watch = impl_->watch, judges = web.authenticator](
                                     const httplib::Request& request, httplib::Response& response) {
    watch.began(request);
    if (bound(request, response) == Handled::Handled) return Handled::Handled;
    return judges && !HttpApi::serves(request.path) ? judge(*judges, request, response) : Handled::Unhandled;
  });
  for (const char* probe : {"/healthz", "/livez"}) {
    server.Get(probe, [](const httplib::Request&, httplib::Response& response) {
      response.set_content("ok\n", "text/plain");
    });
  }
  server.Get("/metrics", [&metrics](const httplib::Request&, httplib::Response& response) {
    response.set_content(metrics.text(), kMetricsType);
  });
  impl_->dashboard.install(server);
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
  impl_->dashboard.stop();
  impl_->api.stop();
  impl_->server->stop();
  impl_->thread.join();
}

}  // namespace lightmill
