#pragma once
// gRPC's credentials from files: mutual TLS whose files are watched, and the client's token on every call.
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "common/rpc/security.h"

namespace lightmill {

/// `files`: resolved, with TLS. The other side must have a certificate of the CA that is for its host name;
/// every call carries "authorization: Bearer TOKEN".
std::shared_ptr<grpc::ChannelCredentials> make_channel_credentials(const SecurityFiles& files);

/// `files`: resolved, with TLS. Clients must have a certificate of the CA.
std::shared_ptr<grpc::ServerCredentials> make_server_credentials(const SecurityFiles& files);

}  // namespace lightmill
