#include "coordinator/http_api/openapi.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "coordinator/access/access.h"

namespace lightmill {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using nlohmann::ordered_json;

constexpr const char* kAbout =
    "Control of a Lightmill render farm. It is the farm's gRPC protocol over HTTP: messages are proto3 JSON "
    "with the "
    "fields' own names, so 64-bit integers are strings. Errors have the code and the body of a "
    "google.rpc.Status. A "
    "stream is a line of JSON a message, {\"result\": message}, and ends with {\"error\": status} if it "
    "fails.";

std::string short_name(const std::string& full) { return full.substr(std::string("lightmill.v1.").size()); }

/// The first sentence of a comment.
std::string summary_of(const std::string& comment) {
  const size_t end = std::min(comment.find(". "), comment.find('\n'));
  return comment.substr(0, end == std::string::npos ? comment.size() : end + (comment[end] == '.' ? 1 : 0));
}

class OpenApi {
 public:
  explicit OpenApi(const ApiRoutes& routes) {
    document_["openapi"] = "3.0.3";
    document_["info"] = {{"title", "Lightmill"}, {"version", "1"}, {"description", kAbout}};
    document_["servers"] = ordered_json::array({{{"url", "/"}}});
    document_["security"] = ordered_json::array({{{"token", ordered_json::array()}}});
    document_["paths"] = ordered_json::object();
    add_status();
    for (const ApiRoute& route : routes.all()) add(route);
    ordered_json& components = document_["components"];
    components["schemas"] = std::move(schemas_);
    components["securitySchemes"]["token"] = {
        {"type", "http"},
        {"scheme", "bearer"},
        {"description", "Where the farm has TLS; without, none is needed."}};
    components["responses"]["Error"] = {{"description", "The call failed."},
                                        {"content", json_content(reference("Status"))}};
  }
  std::string text() const { return document_.dump(1) + "\n"; }

 private:
  static ordered_json reference(const std::string& schema) {
    return {{"$ref", "#/components/schemas/" + schema}};
  }
  static ordered_json json_content(ordered_json schema) {
    return {{"application/json", {{"schema", std::move(schema)}}}};
  }

  void add_status() {
    schemas_["Status"] = {
        {"type", "object"},
        {"description", "Why a call failed, as google.rpc.Status."},
        {"properties",
         {{"code", {{"type", "integer"}, {"format", "int32"}, {"description", "A google.rpc.Code."}}},
          {"message", {{"type", "string"}, {"description", "One line, for the user."}}},
          {"details", {{"type", "array"}, {"items", {{"type", "object"}}}}}}}};
  }

  /// One value of a field.
  ordered_json value(const FieldDescriptor& field) {
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_INT32:
        return {{"type", "integer"}, {"format", "int32"}};
      case FieldDescriptor::CPPTYPE_UINT32:
        return {{"type", "integer"}, {"format", "int64"}};
      case FieldDescriptor::CPPTYPE_INT64:
        return {{"type", "string"}, {"format", "int64"}};
      case FieldDescriptor::CPPTYPE_UINT64:
        return {{"type", "string"}, {"format", "uint64"}};
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return {{"type", "number"}, {"format", "double"}};
      case FieldDescriptor::CPPTYPE_FLOAT:
        return {{"type", "number"}, {"format", "float"}};
      case FieldDescriptor::CPPTYPE_BOOL:
        return {{"type", "boolean"}};
      case FieldDescriptor::CPPTYPE_STRING:
        if (field.type() == FieldDescriptor::TYPE_BYTES) return {{"type", "string"}, {"format", "byte"}};
        return {{"type", "string"}};
      case FieldDescriptor::CPPTYPE_ENUM: {
        auto names = ordered_json::array();
        for (int i = 0; i < field.enum_type()->value_count(); ++i)
          names.push_back(field.enum_type()->value(i)->name());
        return {{"type", "string"}, {"enum", std::move(names)}};
      }
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return reference(add(*field.message_type()));
    }
    return ordered_json::object();
  }

  ordered_json schema(const FieldDescriptor& field) {
    if (field.is_map()) {
      return {{"type", "object"}, {"additionalProperties", value(*field.message_type()->map_value())}};
    }
    if (field.is_repeated()) return {{"type", "array"}, {"items", value(field)}};
    return value(field);
  }

  ordered_json described(const FieldDescriptor& field) {
    ordered_json made = schema(field);
    const std::string comment = comment_of(field);
    if (comment.empty()) return made;
    // Beside a reference nothing else counts.
    if (made.contains("$ref")) made = {{"allOf", ordered_json::array({made})}};
    made["description"] = comment;
    return made;
  }

  /// Adds a message's schema, and returns its name.
  std::string add(const Descriptor& message) {
    const std::string name = short_name(message.full_name());
    if (!seen_.insert(name).second) return name;
    ordered_json made{{"type", "object"}};
    if (const std::string comment = comment_of(message); !comment.empty()) made["description"] = comment;
    auto properties = ordered_json::object();
    for (int i = 0; i < message.field_count(); ++i)
      properties[message.field(i)->name()] = described(*message.field(i));
    made["properties"] = std::move(properties);
    schemas_[name] = std::move(made);
    return name;
  }

  ordered_json parameters(const ApiRoute& route) {
    auto list = ordered_json::array();
    const Descriptor& request = *route.call->input_type();
    for (int i = 0; i < request.field_count(); ++i) {
      const FieldDescriptor& field = *request.field(i);
      const bool in_path = route.in_path(field.name());
      const bool in_query =
          route.body != ApiRoute::Body::kMessage && !field.message_type() && &field != route.body_field;
      if (!in_path && !in_query) continue;
      ordered_json one{{"name", field.name()}, {"in", in_path ? "path" : "query"}, {"required", in_path}};
      if (const std::string comment = comment_of(field); !comment.empty()) one["description"] = comment;
      one["schema"] = schema(field);
      list.push_back(std::move(one));
    }
    return list;
  }

  ordered_json answer(const ApiRoute& route) {
    const Descriptor& message = *route.call->output_type();
    if (route.sends_file()) {
      const ordered_json file{{"schema", {{"type", "string"}, {"format", "binary"}}}};
      return {{"description", "The file."},
              {"content", {{"image/x-exr", file}, {"image/png", file}, {"application/octet-stream", file}}}};
    }
    if (!route.streams())
      return {{"description", "The answer."}, {"content", json_content(reference(add(message)))}};
    const ordered_json line{
        {"type", "object"},
        {"properties", {{"result", reference(add(message))}, {"error", reference("Status")}}}};
    return {{"description", "A line of JSON for each message of the stream."},
            {"content", {{"application/x-ndjson", {{"schema", line}}}}}};
  }

  void add(const ApiRoute& route) {
    ordered_json operation;
    const std::string comment = comment_of(*route.call);
    const AccessRule* const rule = access_rule(route.rpc);
    operation["operationId"] = route.call->name();
    operation["summary"] = summary_of(comment);
    operation["description"] = comment + (rule ? "\n\nRole: " + roles_text(*rule) + "." : "");
    operation["tags"] = ordered_json::array({route.call->service()->name()});
    if (ordered_json list = parameters(route); !list.empty()) operation["parameters"] = std::move(list);
    if (route.body == ApiRoute::Body::kMessage) {
      operation["requestBody"] = {{"content", json_content(reference(add(*route.call->input_type())))}};
    } else if (route.body == ApiRoute::Body::kBytes) {
      const ordered_json bytes{{"schema", {{"type", "string"}, {"format", "binary"}}}};
      operation["requestBody"] = {{"content", {{"application/octet-stream", bytes}}}};
      if (const std::string about = comment_of(*route.body_field); !about.empty())
        operation["requestBody"]["description"] = about;
    }
    operation["responses"] = {{"200", answer(route)},
                              {"default", {{"$ref", "#/components/responses/Error"}}}};
    std::string method = route.method;
    std::transform(method.begin(), method.end(), method.begin(),
                   [](char c) { return static_cast<char>(c | 32); });
    document_["paths"][route.path][method] = std::move(operation);
  }

  ordered_json document_, schemas_ = ordered_json::object();
  std::set<std::string> seen_;
};

}  // namespace

std::string openapi_text(const ApiRoutes& routes) { return OpenApi(routes).text(); }

}  // namespace lightmill
