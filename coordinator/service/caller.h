#pragma once
// Who calls: jobs and workers bear the name of the token that they came with.
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

namespace lightmill {

/// The name of the token that a call carries; an empty function where there are no tokens.
using Caller = std::function<std::string(const grpc::ServerContext&)>;

}  // namespace lightmill
