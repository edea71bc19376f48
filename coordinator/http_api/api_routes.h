#pragma once
// The HTTP routes of RPCs, from the option `http` of each (proto/lightmill/v1/http.proto).
//
//   ApiRoutes routes(description);
//   if (const auto match = routes.find("POST", "/v1/jobs/j1:pause")) ... match->route->rpc
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/http_api/api_description.h"

namespace lightmill {

struct ApiRoute {
  std::string method;  // "GET", "POST", "PUT" or "DELETE"
  std::string path;    // "/v1/jobs/{job_id}:pause"
  std::string rpc;     // "/lightmill.v1.ClientService/PauseJob"
  const google::protobuf::MethodDescriptor* call = nullptr;
  enum class Body { kNone, kMessage, kBytes };
  Body body = Body::kNone;
  const google::protobuf::FieldDescriptor* body_field = nullptr;  // of kBytes
  double deadline_seconds = 0;

  std::vector<std::string> segments;  // of the path; "{job_id}" stands for a field
  std::string verb;                   // behind a colon at the end; may be empty

  bool changes() const { return method != "GET"; }
  bool streams() const { return call->server_streaming(); }
  /// Whether the answer is a file (v1::FileChunk).
  bool sends_file() const { return call->output_type()->full_name() == "lightmill.v1.FileChunk"; }
  /// Whether the path holds this field.
  bool in_path(const std::string& field) const;
};

struct ApiMatch {
  const ApiRoute* route;
  std::vector<std::pair<std::string, std::string>> fields;  // that the path holds: name and value
};

class ApiRoutes {
 public:
  /// `description` must outlive this. Throws std::logic_error for an option that can't be meant: a path that
  /// two RPCs have, a field that the request lacks, a stream of requests.
  explicit ApiRoutes(const ApiDescription& description);
  const std::vector<ApiRoute>& all() const { return routes_; }
  /// `path`: without query, percent signs decoded.
  std::optional<ApiMatch> find(std::string_view method, std::string_view path) const;
  /// The methods that a path has, as the header Allow lists them; empty: there is no such path.
  std::string methods_of(std::string_view path) const;

 private:
  std::vector<ApiRoute> routes_;
};

}  // namespace lightmill
