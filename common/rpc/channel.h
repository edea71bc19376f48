#pragma once
// Channels to a coordinator: keepalive, bounded messages, deadlines, TLS, and the plain-text policy.
//
//   auto stub = v1::ClientService::NewStub(make_channel({.address = "127.0.0.1:7070"}));
//   grpc::ClientContext context;
//   set_deadline(context, kCallSeconds);
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/server_builder.h>

#include <memory>
#include <string>

#include "common/rpc/security.h"

namespace lightmill {

/// No message is larger; what is long goes in chunks.
inline constexpr int kMaxMessageBytes = 16 << 20;
/// Size of the chunks of blobs, partials and images.
inline constexpr size_t kChunkBytes = 1 << 20;
/// Calls under way on one connection. A worker has at most six.
inline constexpr int kMaxStreams = 100;
/// Deadline of a call that answers at once, seconds.
inline constexpr double kCallSeconds = 20;
/// Largest long poll that a coordinator grants, seconds.
inline constexpr double kMaxPollSeconds = 20;

struct ChannelOptions {
  std::string address;       // HOST:PORT, [v6]:PORT, PORT alone means localhost
  bool insecure = false;     // plain text to hosts other than this one was asked for
  SecurityFiles security{};  // resolved; without TLS: plain text
};

/// Sets gRPC up for this process: quiet, and without what its debug checks cost. Channels and servers made
/// here have called it.
void prepare_grpc();

/// Host and port of "HOST:PORT". Throws Error(kUsage) on anything else; the port is 0..65535.
struct HostPort {
  std::string host;
  int port = 0;
};
HostPort parse_address(const std::string& address);

/// True for localhost, 127.0.0.0/8 and ::1, with or without brackets; by the text, nothing is looked up.
bool is_loopback(const std::string& host);

/// Throws Error(kUsage) unless plain text to (or on) this address is allowed: loopback, or `insecure`.
void require_plain_text_allowed(const std::string& address, bool insecure);

/// A channel with TLS and a token, or in plain text under the policy above; connects lazily. A dead peer is
/// noticed within about 20 s.
std::shared_ptr<grpc::Channel> make_channel(const ChannelOptions& options);

/// The same bounds and keepalive for a server.
void configure_server(grpc::ServerBuilder& builder);

/// Sets the deadline of a call, seconds from now.
void set_deadline(grpc::ClientContext& context, double seconds);

}  // namespace lightmill
