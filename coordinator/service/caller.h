#pragma once
// The caller's name: jobs and workers bear that of the token that they came with.
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

namespace lightmill {

/// The name of the token that a call carries. An empty function where there are no tokens.
using Caller = std::function<std::string(const grpc::ServerContext&)>;

}  // namespace lightmill
