#include "coordinator/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <grpcpp/support/channel_arguments.h>

#include <chrono>
#include <ctime>
#include <mutex>
#include <optional>

#include "common/rpc/channel.h"
#include "common/rpc/grpc_credentials.h"
#include "coordinator/http/http_server.h"
#include "coordinator/service/client_service.h"
#include "coordinator/service/limits/listener.h"
#include "coordinator/service/limits/stream_limit.h"
#include "coordinator/service/sequence_service.h"
#include "coordinator/service/thin_client_service.h"
#include "coordinator/service/token_processor.h"
#include "coordinator/service/worker_service.h"

namespace lightmill {
namespace {

constexpr std::chrono::seconds kShutdownGrace(3);
constexpr double kConnectionBurstSeconds = 5;

void enable_plugins() {
  static std::once_flag once;
  std::call_once(once, [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

/// All but the authenticator outlive the metrics.
void count_refusals(Metrics& metrics, const Listener& listener, const SubmitLimit& submissions,
                    const std::shared_ptr<Authenticator>& authenticator) {
  metrics.count_refusals("connection", [&listener] { return listener.refused(); });
  metrics.count_refusals("submit_rate", [&submissions] { return submissions.refused(); });
  if (!authenticator) return;
  metrics.count_refusals("unauthenticated",
                         [authenticator] { return authenticator->refused(Verdict::Kind::kUnauthenticated); });
  metrics.count_refusals("forbidden",
                         [authenticator] { return authenticator->refused(Verdict::Kind::kForbidden); });
}

}  // namespace

namespace {

/// For calls from this process, whose tokens were judged before (coordinator/http_api).
grpc::ChannelArguments in_process() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return arguments;
}

/// The name of the token that a call of this RPC carries, which the TokenProcessor has let through.
Caller callers(const std::shared_ptr<Authenticator>& authenticator, const char* rpc) {
  if (!authenticator) return {};
  return [authenticator, rpc](const grpc::ServerContext& context) {
    const auto& metadata = context.client_metadata();
    const auto found = metadata.find("authorization");
    if (found == metadata.end()) return std::string();
    return authenticator->judge(rpc, {found->second.data(), found->second.size()}, std::time(nullptr)).name;
  };
}

}  // namespace

struct Server::Impl {
  Impl(const ServerOptions& options, Farm& the_farm, BlobStore& blobs,
       const std::shared_ptr<Authenticator>& authenticator)
      : farm(the_farm),
        submissions(std::make_shared<SubmitLimit>(options.quotas.submissions_per_minute)),
        metrics(farm, options.metrics),
        tile_log(options.tile_log ? *options.tile_log : own_tile_log),
        stalls(clock, options.quotas.stall_seconds),
        client_service(farm, blobs, tile_log, stalls, options.quotas, submission_gate,
                       options.security.tls() ? nullptr : submissions,
                       callers(authenticator, "/lightmill.v1.ClientService/SubmitJob")),
        sequence_service(farm, blobs, stalls, options.quotas, submission_gate,
                         options.security.tls() ? nullptr : submissions,
                         callers(authenticator, "/lightmill.v1.SequenceService/SubmitSequence")),
        scenes(farm, blobs, options.quotas, options.read_scene),
        uploads(blobs, options.quotas.max_bundle_bytes),
        thin_client_service(farm, scenes, uploads, stalls, options.security.tls() ? nullptr : submissions,
                            callers(authenticator, "/lightmill.v1.ThinClientService/SubmitScene")),
        worker_service(farm, blobs, metrics, tile_log, stalls, options.quotas, options.lease_seconds,
                       callers(authenticator, "/lightmill.v1.WorkerService/Register"), options.wanted) {}
  Farm& farm;
  const std::shared_ptr<SubmitLimit> submissions;
  std::optional<Listener> listener;
  Metrics metrics;
  TileLog own_tile_log;
  TileLog& tile_log;
  const SteadyClock clock;
  StallWatch stalls;
  SubmissionGate submission_gate;
  ClientService client_service;
  SequenceService sequence_service;
  SceneDesk scenes;
  Uploads uploads;
  ThinClientService thin_client_service;
  WorkerService worker_service;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> rpc;
  const EventLog no_events;
  std::optional<HttpServer> http;
};

Server::Server(const ServerOptions& options, Farm& farm, BlobStore& blobs) {
  const bool tls = options.security.tls();
  if (!tls) {
    require_plain_text_allowed(options.listen, options.insecure);
    if (!options.http.empty()) require_plain_text_allowed(options.http, options.insecure);
  }
  const auto log = options.log ? options.log : [](const std::string&) {};
  const auto authenticator =
      tls ? std::make_shared<Authenticator>(options.security.token, log) : std::shared_ptr<Authenticator>();
  impl_ = std::make_unique<Impl>(options, farm, blobs, authenticator);
  const auto credentials =
      tls ? make_server_credentials(options.security) : grpc::InsecureServerCredentials();
  if (tls)
    credentials->SetAuthMetadataProcessor(std::make_shared<TokenProcessor>(
        authenticator, impl_->submissions, [&farm](const std::string& reason) { farm.turned_away(reason); }));
  impl_->listener.emplace(ListenerOptions{options.listen, options.quotas.max_connections,
                                          options.quotas.connections_per_second,
                                          options.quotas.connections_per_second * kConnectionBurstSeconds});
  enable_plugins();
  grpc::ServerBuilder builder;
  configure_server(builder);
  using Experimental = grpc::ServerBuilder::experimental_type;
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<StreamLimit>(2 * kMaxStreams));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  impl_->acceptor = builder.experimental().AddExternalConnectionAcceptor(
      Experimental::ExternalConnectionType::FROM_FD, credentials);
  builder.RegisterService(&impl_->client_service);
  builder.RegisterService(&impl_->sequence_service);
  builder.RegisterService(&impl_->thin_client_service);
  builder.RegisterService(&impl_->worker_service);
  impl_->rpc = builder.BuildAndStart();
  if (!impl_->rpc) throw Error(ErrorKind::kFailed, "gRPC does not start");
  impl_->metrics.count_damaged_blobs([&blobs] { return blobs.damaged(); });
  count_refusals(impl_->metrics, *impl_->listener, *impl_->submissions, authenticator);
  if (!options.http.empty()) {
    const bool loopback_only = !tls && is_loopback(parse_address(options.http).host);
    impl_->http.emplace(
        options.http,
        WebOptions{farm, blobs, options.events ? *options.events : impl_->no_events, options.quotas,
                   impl_->submissions, authenticator, log, loopback_only, &impl_->uploads, &impl_->scenes,
                   &impl_->tile_log, options.thumbnail_folder},
        impl_->metrics, options.security, impl_->rpc->InProcessChannel(in_process()));
  }
  impl_->listener->open([acceptor = impl_->acceptor.get()](int fd) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = fd;
    acceptor->HandleNewConnection(&connection);
  });
}

Server::~Server() {
  if (!impl_->rpc) return;
  impl_->http.reset();  // its metrics ask the listener
  impl_->listener.reset();
  impl_->client_service.stop();
  impl_->sequence_service.stop();
  impl_->worker_service.stop();
  impl_->farm.stop_waiting();
  impl_->rpc->Shutdown(std::chrono::system_clock::now() + kShutdownGrace);
  impl_->rpc->Wait();
}

int Server::rpc_port() const { return impl_->listener->port(); }
int Server::http_port() const { return impl_->http ? impl_->http->port() : 0; }

}  // namespace lightmill
