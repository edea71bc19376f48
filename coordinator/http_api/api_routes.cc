#include "coordinator/http_api/api_routes.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <tuple>

#include "lightmill/v1/http.pb.h"

namespace lightmill {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::MethodDescriptor;

constexpr double kUsualDeadline = 30, kUsualStreamDeadline = 3600;  // seconds
constexpr std::string_view kPrefix = "/v1/";

[[noreturn]] void impossible(const MethodDescriptor& call, const std::string& why) {
  throw std::logic_error("the option http of " + call.full_name() + ": " + why);
}

/// The path's segments and the verb behind it.
std::pair<std::vector<std::string>, std::string> split_path(std::string_view path) {
  std::pair<std::vector<std::string>, std::string> parts;
  path.remove_prefix(std::min<size_t>(path.size(), 1));
  while (true) {
    const size_t slash = path.find('/');
    parts.first.emplace_back(path.substr(0, slash));
    if (slash == std::string_view::npos) break;
    path.remove_prefix(slash + 1);
  }
  std::string& last = parts.first.back();
  if (const size_t colon = last.rfind(':'); colon != std::string::npos) {
    parts.second = last.substr(colon + 1);
    last.resize(colon);
  }
  return parts;
}

bool is_field(std::string_view segment) { return segment.starts_with('{') && segment.ends_with('}'); }

std::pair<std::string, std::string> pattern_of(const v1::HttpRoute& option) {
  switch (option.pattern_case()) {
    case v1::HttpRoute::kGet:
      return {"GET", option.get()};
    case v1::HttpRoute::kPost:
      return {"POST", option.post()};
    case v1::HttpRoute::kPut:
      return {"PUT", option.put()};
    case v1::HttpRoute::kDelete:
      return {"DELETE", option.delete_()};
    case v1::HttpRoute::PATTERN_NOT_SET:
      break;
  }
  return {};
}

ApiRoute route_of(const MethodDescriptor& call, const v1::HttpRoute& option) {
  ApiRoute route;
  std::tie(route.method, route.path) = pattern_of(option);
  if (!route.path.starts_with(kPrefix)) impossible(call, "give a path below /v1");
  if (call.client_streaming()) impossible(call, "a stream of requests has no HTTP");
  route.call = &call;
  route.rpc = "/" + call.service()->full_name() + "/" + call.name();
  route.deadline_seconds = option.deadline_seconds() > 0 ? option.deadline_seconds()
                           : call.server_streaming()     ? kUsualStreamDeadline
                                                         : kUsualDeadline;
  std::tie(route.segments, route.verb) = split_path(route.path);
  for (const std::string& segment : route.segments) {
    if (!is_field(segment)) continue;
    const FieldDescriptor* const field =
        call.input_type()->FindFieldByName(segment.substr(1, segment.size() - 2));
    if (!field || field->is_repeated() || field->message_type())
      impossible(call, segment + " is no field of one value");
  }
  if (option.body() == "*") {
    route.body = ApiRoute::Body::kMessage;
  } else if (!option.body().empty()) {
    route.body = ApiRoute::Body::kBytes;
    route.body_field = call.input_type()->FindFieldByName(option.body());
    if (!route.body_field || route.body_field->type() != FieldDescriptor::TYPE_BYTES)
      impossible(call, option.body() + " is no field of bytes");
  }
  if (route.method == "GET" && route.body != ApiRoute::Body::kNone) impossible(call, "GET has no body");
  return route;
}

/// Whether the path fits; the fields that it holds go to `fields`.
bool fits(const ApiRoute& route, const std::pair<std::vector<std::string>, std::string>& path,
          std::vector<std::pair<std::string, std::string>>* fields) {
  const std::vector<std::string>& segments = path.first;
  if (route.verb != path.second || route.segments.size() != segments.size()) return false;
  for (size_t i = 0; i < segments.size(); ++i) {
    const std::string& wanted = route.segments[i];
    if (is_field(wanted) ? segments[i].empty() : wanted != segments[i]) return false;
    if (is_field(wanted) && fields) fields->emplace_back(wanted.substr(1, wanted.size() - 2), segments[i]);
  }
  return true;
}

}  // namespace

bool ApiRoute::in_path(const std::string& field) const {
  return std::find(segments.begin(), segments.end(), "{" + field + "}") != segments.end();
}

ApiRoutes::ApiRoutes(const ApiDescription& description) {
  std::set<std::string> seen;
  for (const google::protobuf::ServiceDescriptor* service : description.services()) {
    for (int i = 0; i < service->method_count(); ++i) {
      const MethodDescriptor& call = *service->method(i);
      if (!call.options().HasExtension(v1::http)) continue;
      routes_.push_back(route_of(call, call.options().GetExtension(v1::http)));
      std::string place = routes_.back().method + " ";
      for (const std::string& segment : routes_.back().segments)
        place += "/" + (is_field(segment) ? std::string("*") : segment);
      if (!seen.insert(place + ":" + routes_.back().verb).second)
        impossible(call, "another RPC has this path");
    }
  }
}

std::optional<ApiMatch> ApiRoutes::find(std::string_view method, std::string_view path) const {
  const auto parts = split_path(path);
  const ApiRoute* best = nullptr;
  for (const ApiRoute& route : routes_) {
    if (route.method != method || !fits(route, parts, nullptr)) continue;
    // A word of the path goes before a field: "/v1/jobs/latest" before "/v1/jobs/{job_id}".
    if (!best || std::count_if(route.segments.begin(), route.segments.end(), is_field) <
                     std::count_if(best->segments.begin(), best->segments.end(), is_field))
      best = &route;
  }
  if (!best) return std::nullopt;
  ApiMatch match{best, {}};
  fits(*best, parts, &match.fields);
  return match;
}

std::string ApiRoutes::methods_of(std::string_view path) const {
  const auto parts = split_path(path);
  std::set<std::string> methods;
  for (const ApiRoute& route : routes_) {
    if (fits(route, parts, nullptr)) methods.insert(route.method);
  }
  std::string text;
  for (const std::string& method : methods) text += (text.empty() ? "" : ", ") + method;
  return text;
}

}  // namespace lightmill
