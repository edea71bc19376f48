#include "common/rpc/channel.h"

#include <absl/synchronization/mutex.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/credentials.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <mutex>

#include "common/base/error.h"
#include "common/rpc/grpc_credentials.h"

namespace lightmill {
namespace {

constexpr int kMinPollers = 2, kMaxPollers = 16;  // of each completion queue
constexpr int kKeepaliveMs = 10000;
constexpr int kKeepaliveTimeoutMs = 10000;
constexpr int kMaxBackoffMs = 5000;
constexpr int kHandshakeTimeoutMs = 10000;  // a peer that says nothing is cut off
// Of what peers have sent and nobody has read yet. Whoever holds most is cut off when it is used up.
constexpr size_t kServerBuffers = size_t{96} << 20;

[[noreturn]] void bad_address(const std::string& address) {
  throw Error(ErrorKind::kUsage,
              "\"" + address + "\" is not an address; write HOST:PORT, as in localhost:7070");
}

}  // namespace

// What goes wrong is said once, by us. GRPC_VERBOSITY in the environment brings gRPC's and Protobuf's own
// lines back. Debian's Abseil is built with its search for deadlocks on: each lock that gRPC takes goes into
// a graph under a global lock, which took a twelfth of a coordinator's processor time.
void prepare_grpc() {
  static std::once_flag once;
  std::call_once(once, [] {
    absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
    if (std::getenv("GRPC_VERBOSITY")) return;
    gpr_set_log_function([](gpr_log_func_args*) {});
    google::protobuf::SetLogHandler(nullptr);
  });
}

HostPort parse_address(const std::string& address) {
  const size_t colon = address.rfind(':');
  HostPort result;
  std::string port = address;
  if (colon == std::string::npos) {
    result.host = "localhost";
  } else {
    result.host = address.substr(0, colon);
    port = address.substr(colon + 1);
  }
  if (result.host.size() >= 2 && result.host.front() == '[' && result.host.back() == ']') {
    result.host = result.host.substr(1, result.host.size() - 2);
  } else if (result.host.find(':') != std::string::npos) {
    bad_address(address);
  }
  if (result.host.empty() || result.host.size() > 255) bad_address(address);
  for (char c : result.host) {
    if (static_cast<unsigned char>(c) <= 0x20 || c == '/' || c == '%') bad_address(address);
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), result.port);
  if (port.empty() || error != std::errc() || end != port.data() + port.size() || result.port < 0 ||
      result.port > 65535) {
    bad_address(address);
  }
  return result;
}

bool is_loopback(const std::string& host) {
  std::string name = host;
  if (name.size() >= 2 && name.front() == '[' && name.back() == ']') name = name.substr(1, name.size() - 2);
  if (name == "localhost" || name == "::1") return true;
  if (!name.starts_with("127.")) return false;
  // All four parts must be numbers: "127.0.0.1.example.org" is somebody else's host.
  int parts = 0;
  for (const char* p = name.data(); p < name.data() + name.size();) {
    int value = 0;
    const auto [end, error] = std::from_chars(p, name.data() + name.size(), value);
    if (error != std::errc() || value < 0 || value > 255) return false;
    ++parts;
    p = end;
    if (p == name.data() + name.size()) break;
    if (*p++ != '.') return false;
  }
  return parts == 4 && name.back() != '.';
}

void require_plain_text_allowed(const std::string& address, bool insecure) {
  const HostPort peer = parse_address(address);
  if (insecure || is_loopback(peer.host)) return;
  throw Error(ErrorKind::kUsage,
              address + " is not on this machine and the connection would be plain text; " +
                  "give --credentials DIR for TLS (lightmill-coordinator init makes it), or " +
                  "--insecure to accept that");
}

std::shared_ptr<grpc::Channel> make_channel(const ChannelOptions& options) {
  prepare_grpc();
  const bool tls = options.security.tls();
  if (!tls) require_plain_text_allowed(options.address, options.insecure);
  const HostPort peer = parse_address(options.address);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetMaxSendMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kMaxBackoffMs);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 200);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // a proxy in the environment is not meant for the farm
  const bool v6 = peer.host.find(':') != std::string::npos;
  const std::string target = (v6 ? "[" + peer.host + "]" : peer.host) + ":" + std::to_string(peer.port);
  return grpc::CreateCustomChannel(
      target, tls ? make_channel_credentials(options.security) : grpc::InsecureChannelCredentials(),
      arguments);
}

void configure_server(grpc::ServerBuilder& builder) {
  prepare_grpc();
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  builder.SetMaxSendMessageSize(kMaxMessageBytes);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kKeepaliveMs / 2);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreams);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // a second coordinator on the port is an error
  // gRPC's own one or two pollers end and start threads with almost every call.
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, kMinPollers);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, kMaxPollers);
  grpc::ResourceQuota quota("lightmill");
  quota.SetMaxThreads(512);
  quota.Resize(kServerBuffers);
  builder.SetResourceQuota(quota);
}

void set_deadline(grpc::ClientContext& context, double seconds) {
  context.set_deadline(std::chrono::system_clock::now() +
                       std::chrono::duration_cast<std::chrono::system_clock::duration>(
                           std::chrono::duration<double>(seconds)));
}

}  // namespace lightmill
