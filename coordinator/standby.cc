#include "coordinator/standby.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <httplib.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "common/rpc/channel.h"
#include "common/rpc/grpc_credentials.h"
#include "coordinator/http/http_base.h"
#include "coordinator/http/http_watch.h"
#include "coordinator/http/metrics.h"
#include "coordinator/http_api/http_api.h"
#include "coordinator/http_api/http_status.h"

namespace lightmill {
namespace {

/// What is said to whoever calls. Thread-safe.
class Notice {
 public:
  void set_leader(const std::string& address) {
    const std::lock_guard lock(mutex_);
    const std::string who = address.empty() ? "another coordinator" : "the coordinator at " + address;
    text_ = "standby: " + who + " leads this farm";
  }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_ = "standby: another coordinator leads this farm";
};

/// Answers every call of every service.
class Refusal : public grpc::CallbackGenericService {
 public:
  explicit Refusal(const Notice& notice) : notice_(notice) {}
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    struct Reactor : grpc::ServerGenericBidiReactor {
      explicit Reactor(const std::string& why) { Finish({grpc::StatusCode::UNAVAILABLE, why}); }
      void OnDone() override { delete this; }
    };
    return new Reactor(notice_.text());
  }

 private:
  const Notice& notice_;
};

}  // namespace

struct Standby::Impl {
  Impl() : refusal(notice) {}
  Notice notice;
  Refusal refusal;
  int rpc_port = 0, http_port = 0;
  std::unique_ptr<grpc::Server> rpc;
  SecurityFiles files;
  std::unique_ptr<httplib::Server> http;
  std::optional<HttpWatch> watch;
  std::atomic<bool> http_ended{false};
  std::thread http_thread;
};

Standby::Standby(const ServerOptions& options) : impl_(std::make_unique<Impl>()) {
  const bool tls = options.security.tls();
  if (!tls) {
    require_plain_text_allowed(options.listen, options.insecure);
    if (!options.http.empty()) require_plain_text_allowed(options.http, options.insecure);
  }
  impl_->files = options.security;
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  configure_server(builder);
  builder.AddListeningPort(
      options.listen, tls ? make_server_credentials(options.security) : grpc::InsecureServerCredentials(),
      &impl_->rpc_port);
  builder.RegisterCallbackGenericService(&impl_->refusal);
  impl_->rpc = builder.BuildAndStart();
  if (!impl_->rpc || impl_->rpc_port <= 0) {
    throw Error(ErrorKind::kFailed,
                "--listen " + options.listen + ": can't listen there; is the port in use?");
  }
  impl_->rpc->GetHealthCheckService()->SetServingStatus(false);
  if (options.http.empty()) return;
  impl_->http = make_http_server(impl_->files);
  impl_->watch.emplace(*impl_->http);
  impl_->http->new_task_queue = [] { return new httplib::ThreadPool(2 * HttpWatch::kMostSilent); };
  impl_->http->set_pre_routing_handler([&notice = impl_->notice, &watch = *impl_->watch](
                                           const httplib::Request& request, httplib::Response& response) {
    watch.began(request);
    if (request.path == "/metrics") {
      response.set_content(standby_metrics(), kMetricsType);
      return httplib::Server::HandlerResponse::Handled;
    }
    response.status = request.path == "/livez" ? 200 : 503;
    if (HttpApi::serves(request.path)) {
      response.set_content(error_json({grpc::StatusCode::UNAVAILABLE, notice.text()}), "application/json");
      return httplib::Server::HandlerResponse::Handled;
    }
    response.set_content(notice.text() + "\n", "text/plain");
    return httplib::Server::HandlerResponse::Handled;
  });
  impl_->http_port = bind_http(*impl_->http, options.http);
  impl_->watch->start(impl_->http_port);
  impl_->http_thread = std::thread([this] {
    impl_->http->listen_after_bind();
    impl_->http_ended = true;
  });
}

Standby::~Standby() {
  if (impl_->http_thread.joinable()) {
    // stop() does nothing before the thread has begun to listen.
    while (!impl_->http->is_running() && !impl_->http_ended) std::this_thread::yield();
    impl_->http->stop();
    impl_->http_thread.join();
  }
  impl_->rpc->Shutdown(std::chrono::system_clock::now());
  impl_->rpc->Wait();
}

void Standby::set_leader(const std::string& address) { impl_->notice.set_leader(address); }
int Standby::rpc_port() const { return impl_->rpc_port; }
int Standby::http_port() const { return impl_->http_port; }

}  // namespace lightmill
