#pragma once
// A cpp-httplib server with TLS or without, on an address of ours.
#include <memory>
#include <string>

#include "common/rpc/security.h"

namespace httplib {
class Server;
}

namespace lightmill {

/// `files` outlives it: with TLS every connection gets the certificate of the moment.
std::unique_ptr<httplib::Server> make_http_server(const SecurityFiles& files);
/// Binds HOST:PORT, and returns the port. Throws Error(kFailed) if it can't be had.
int bind_http(httplib::Server& server, const std::string& address);

}  // namespace lightmill
