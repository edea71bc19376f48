#pragma once
// Bodies of requests: how long they may be, and how they are read.
#include <httplib.h>

#include <string>

#include "coordinator/http_api/api_routes.h"

namespace lightmill {

/// Bytes of a body of any call; most calls take less.
inline constexpr size_t kMaxApiBody = size_t{16} << 20;

/// What a body of this call may have, before it is unpacked: some times what its message may.
size_t body_limit(const ApiRoute& route);

/// The same bound as gRPC has for the message itself, which streams there refuse without a word. Throws
/// LimitReached.
void check_message(const ApiRoute& route, size_t bytes);

/// Reads a body to its end; without `body` it is thrown away. False if the peer is away, or sends next to
/// nothing for long.
bool read_body(const httplib::ContentReader& reader, std::string* body);

}  // namespace lightmill
