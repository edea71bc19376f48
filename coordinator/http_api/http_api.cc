#include "coordinator/http_api/http_api.h"

#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <optional>
#include <utility>

#include "coordinator/http_api/api_call.h"
#include "coordinator/http_api/caller_slots.h"
#include "coordinator/http_api/http_status.h"
#include "coordinator/http_api/openapi.h"
#include "coordinator/http_api/request_body.h"
#include "coordinator/http_api/send_rate.h"
#include "coordinator/http_api/transcoding.h"
#include "coordinator/service/limits/reservation.h"
#include "coordinator/service/service_status.h"
#include "coordinator/web/guard.h"
#include "lightmill/v1/http.pb.h"

namespace lightmill {
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

constexpr const char* kOpenApiPath = "/v1/openapi.json";
constexpr const char* kJson = "application/json";
/// Of bodies and answers of all calls together.
constexpr uint64_t kMostBytes = uint64_t{128} << 20;
constexpr size_t kMaxAuthorization = 4096;

/// An answer that is no RPC's: HTTP has codes for what gRPC has not.
struct HttpError {
  int http;
  grpc::StatusCode code;
  std::string message;
};

void answer_error(Response& response, const grpc::Status& status, int http = 0) {
  response.status = http > 0 ? http : http_status(status.error_code());
  if (response.status == 429) response.set_header("Retry-After", "1");
  if (response.status == 401) response.set_header("WWW-Authenticate", "Bearer realm=\"Lightmill\"");
  response.set_content(error_json(status) + "\n", kJson);
}

bool is_printable(const std::string& text) {
  return text.size() <= kMaxAuthorization &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

struct HttpApi::Impl {
  explicit Impl(const HttpApiOptions& from)
      : options(from),
        routes(description),
        openapi(openapi_text(routes)),
        slots(kMaxCalls, kMaxCallsOfCaller),
        calls(from.channel) {}

  /// A request while it is being answered.
  struct Served {
    Served(Impl& impl, const std::string& caller) : place(impl.slots, caller), room(impl.bytes, kMostBytes) {}
    const CallerSlots::Place place;
    Reservation room;
    std::optional<ApiCall> call;
    SendRate rate;
    std::string pending;  // to be sent next
    size_t at = 0;        // of a file: where `pending` begins
  };
  using ServedPtr = std::shared_ptr<Served>;

  void serve(const Request& request, Response& response, const ContentReader* reader);
  void answer(const Request& request, Response& response, const ContentReader* reader, bool* body_read);
  Verdict judge(const Request& request, const std::string& path) const;
  void check_body(const Request& request, const ApiRoute& route) const;
  grpc::Status answer_message(const ServedPtr& served, const ApiRoute& route, Response& response);
  grpc::Status answer_lines(const ServedPtr& served, const ApiRoute& route, Response& response);
  grpc::Status answer_file(const ServedPtr& served, Response& response);

  const HttpApiOptions options;
  const ApiDescription description;
  const ApiRoutes routes;
  const std::string openapi;
  CallerSlots slots;
  std::atomic<uint64_t> bytes{0};
  ApiCalls calls;
};

Verdict HttpApi::Impl::judge(const Request& request, const std::string& path) const {
  if (!options.authenticator) return {Verdict::Kind::kAllowed, "", ""};
  const std::string authorization = request.get_header_value("Authorization");
  return options.authenticator->judge(path, is_printable(authorization) ? authorization : "",
                                      std::time(nullptr));
}

/// Throws HttpError for a body that the route does not take.
void HttpApi::Impl::check_body(const Request& request, const ApiRoute& route) const {
  const auto length = request.get_header_value<uint64_t>("Content-Length");
  const std::string type = request.get_header_value("Content-Type");
  const size_t most = body_limit(route);
  if (length > most) {
    throw HttpError{413, grpc::StatusCode::RESOURCE_EXHAUSTED,
                    "the body has " + std::to_string(length) + " bytes; it may have " + std::to_string(most)};
  }
  if (type.starts_with("multipart/") ||
      (route.body == ApiRoute::Body::kMessage && length > 0 && !type.starts_with(kJson))) {
    throw HttpError{415, grpc::StatusCode::INVALID_ARGUMENT,
                    "send the body as " + std::string(route.body == ApiRoute::Body::kMessage
                                                          ? "application/json (curl --json)"
                                                          : "application/octet-stream")};
  }
}

void HttpApi::Impl::serve(const Request& request, Response& response, const ContentReader* reader) {
  response.set_header("Cache-Control", "no-store");
  bool body_read = reader == nullptr;
  int http = 0;
  const grpc::Status status = guarded([&] {
    try {
      answer(request, response, reader, &body_read);
      return grpc::Status::OK;
    } catch (const HttpError& error) {
      http = error.http;
      return grpc::Status(error.code, error.message);
    }
  });
  if (status.ok()) return;
  // What is left of the body would be taken for the next request.
  const bool multipart = request.get_header_value("Content-Type").starts_with("multipart/");
  if (!body_read && !multipart && request.get_header_value<uint64_t>("Content-Length") <= kMaxApiBody)
    read_body(*reader, nullptr);
  answer_error(response, status, http);
}

void HttpApi::Impl::answer(const Request& request, Response& response, const ContentReader* reader,
                           bool* body_read) {
  if (options.loopback_only) {
    if (const std::string why = foreign_host(request); !why.empty())
      throw HttpError{403, grpc::StatusCode::PERMISSION_DENIED, why};
  }
  const std::string method = request.method == "HEAD" ? "GET" : request.method;
  const bool describes = request.path == kOpenApiPath && method == "GET";
  const auto match = routes.find(method, request.path);
  const Verdict verdict = judge(request, match ? match->route->rpc : request.path);
  if (verdict.kind == Verdict::Kind::kUnauthenticated)
    throw HttpError{401, grpc::StatusCode::UNAUTHENTICATED, verdict.message};
  if (!match && !describes) {
    const std::string methods = routes.methods_of(request.path);
    if (methods.empty())
      throw HttpError{404, grpc::StatusCode::NOT_FOUND,
                      "there is no " + request.path.substr(0, 200) + "; see " + kOpenApiPath};
    response.set_header("Allow", methods);
    throw HttpError{405, grpc::StatusCode::UNIMPLEMENTED, "this path has " + methods + " only"};
  }
  if (verdict.kind == Verdict::Kind::kForbidden)
    throw HttpError{403, grpc::StatusCode::PERMISSION_DENIED, verdict.message};
  if (!request.ranges.empty())
    throw HttpError{416, grpc::StatusCode::OUT_OF_RANGE, "ranges of bytes are not served here"};
  if (describes) return response.set_content(openapi, kJson);

  const ApiRoute& route = *match->route;
  if (route.changes()) {
    if (const std::string why = foreign_page(request); !why.empty())
      throw HttpError{403, grpc::StatusCode::PERMISSION_DENIED, why};
  }
  const auto served =
      std::make_shared<Served>(*this, options.authenticator ? verdict.name : request.remote_addr);
  if (!served->place.granted())
    throw LimitReached("too many calls of yours or of all are under way; try again");
  std::string body;
  if (reader) {
    check_body(request, route);
    if (!served->room.take(request.get_header_value<uint64_t>("Content-Length")))
      throw LimitReached("bodies and answers fill the memory that they have; try again");
    *body_read = true;
    if (!read_body(*reader, &body)) throw Error(ErrorKind::kUsage, "the body did not arrive whole");
  }
  if (options.authenticator && options.submissions && is_submission(route.rpc)) {
    const std::string refusal = options.submissions->refusal(verdict.name);
    if (!refusal.empty()) throw LimitReached(refusal);
  }
  const std::string message = request_bytes(description, *match, request.params, body);
  std::string().swap(body);
  check_message(route, message.size());
  served->call.emplace(calls, route.rpc,
                       options.authenticator ? request.get_header_value("Authorization") : "",
                       route.deadline_seconds, message);
  const grpc::Status status = route.sends_file() ? answer_file(served, response)
                              : route.streams()  ? answer_lines(served, route, response)
                                                 : answer_message(served, route, response);
  if (!status.ok()) throw StatusError(status);
}

grpc::Status HttpApi::Impl::answer_message(const ServedPtr& served, const ApiRoute& route,
                                           Response& response) {
  std::string message;
  if (!served->call->read(&message)) return served->call->finish();
  if (std::string more; served->call->read(&more)) return {grpc::StatusCode::INTERNAL, "a second answer"};
  if (const grpc::Status status = served->call->finish(); !status.ok()) return status;
  served->pending = message_json(description, *route.call->output_type(), message) + "\n";
  if (!served->room.take(served->pending.size()))
    throw LimitReached("bodies and answers fill the memory that they have; try again");
  response.set_content_provider(
      served->pending.size(), kJson, [served](size_t offset, size_t length, httplib::DataSink& sink) {
        return served->rate.write(sink, std::string_view(served->pending).substr(offset, length));
      });
  return grpc::Status::OK;
}

grpc::Status HttpApi::Impl::answer_lines(const ServedPtr& served, const ApiRoute& route, Response& response) {
  const auto line = [this, &type = *route.call->output_type()](const std::string& message) {
    return "{\"result\":" + message_json(description, type, message) + "}\n";
  };
  std::string first;
  const bool any = served->call->read(&first);
  if (!any) {
    if (const grpc::Status status = served->call->finish(); !status.ok()) return status;
  } else {
    served->pending = line(first);
  }
  response.set_header("X-Accel-Buffering", "no");  // of proxies that would collect what must flow
  response.set_chunked_content_provider("application/x-ndjson",
                                        [served, line](size_t, httplib::DataSink& sink) {
                                          if (!served->pending.empty()) {
                                            const std::string text = std::exchange(served->pending, "");
                                            return served->rate.write(sink, text);
                                          }
                                          std::string message;
                                          const bool more = served->call->read(&message);
                                          std::string text;
                                          const grpc::Status status = guarded([&] {
                                            if (more) text = line(message);
                                            return more ? grpc::Status::OK : served->call->finish();
                                          });
                                          if (!status.ok()) text = "{\"error\":" + error_json(status) + "}\n";
                                          if (!served->rate.write(sink, text)) return false;
                                          if (!more || !status.ok()) sink.done();
                                          return true;
                                        });
  return grpc::Status::OK;
}

grpc::Status HttpApi::Impl::answer_file(const ServedPtr& served, Response& response) {
  const auto next = [](Served& of, v1::FileChunk* chunk) {
    std::string message;
    return of.call->read(&message) && chunk->ParseFromString(message);
  };
  v1::FileChunk chunk;
  if (!next(*served, &chunk)) {
    const grpc::Status status = served->call->finish();
    return status.ok() ? grpc::Status(grpc::StatusCode::INTERNAL, "a file without a beginning") : status;
  }
  served->pending = std::move(*chunk.mutable_content());
  response.set_header("Content-Disposition", "attachment; filename=\"" + chunk.file_name() + "\"");
  response.set_content_provider(chunk.file_size(), chunk.content_type(),
                                [served, next](size_t offset, size_t length, httplib::DataSink& sink) {
                                  if (offset != served->at) return false;
                                  v1::FileChunk more;
                                  if (served->pending.empty()) {
                                    if (!next(*served, &more))
                                      return false;  // the peer sees that bytes are missing
                                    served->pending = std::move(*more.mutable_content());
                                  }
                                  const std::string part = std::exchange(served->pending, "");
                                  served->at += part.size();
                                  return part.size() <= length && served->rate.write(sink, part);
                                });
  return grpc::Status::OK;
}

HttpApi::HttpApi(const HttpApiOptions& options) : impl_(std::make_unique<Impl>(options)) {}
HttpApi::~HttpApi() = default;

void HttpApi::stop() { impl_->calls.stop(); }

void HttpApi::install(httplib::Server& server) {
  constexpr const char* kAll = "/v1/.*";
  server.Get(
      kAll, [this](const Request& request, Response& response) { impl_->serve(request, response, nullptr); });
  const auto with_body = [this](const Request& request, Response& response, const ContentReader& reader) {
    // Without a length it has no body; the library would read until the peer hangs up.
    impl_->serve(request, response, request.has_header("Content-Length") ? &reader : nullptr);
  };
  server.Post(kAll, with_body);
  server.Put(kAll, with_body);
  server.Patch(kAll, with_body);  // no call has it, but its body must not be read by others
  server.Delete(kAll, with_body);
}

}  // namespace lightmill
