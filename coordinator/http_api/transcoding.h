#pragma once
// Between HTTP and messages: path, query and body become a request's bytes, and an answer's bytes become
// JSON. All of it is protobuf's own JSON (proto3's mapping, with the fields' own names), of whatever message
// the route names.
#include <map>
#include <string>
#include <string_view>

#include "coordinator/http_api/api_routes.h"

namespace lightmill {

/// The request of a call. `body` is as the route says. Throws Error(kUsage), in one line, for a parameter or
/// a field that the request does not have, or that has no such value.
std::string request_bytes(const ApiDescription& description, const ApiMatch& match,
                          const std::multimap<std::string, std::string>& query, std::string_view body);

/// A message as JSON; fields that are zero are there. Throws std::runtime_error for bytes that are no such
/// message.
std::string message_json(const ApiDescription& description, const google::protobuf::Descriptor& message,
                         const std::string& bytes);

}  // namespace lightmill
