#include "coordinator/http_api/transcoding.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/wire_format_lite.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/error.h"
#include "common/base/utf8.h"
#include "common/rpc/status.h"

namespace lightmill {
namespace {

using google::protobuf::FieldDescriptor;

/// Longest value of a parameter that a message quotes, bytes.
constexpr size_t kMostQuoted = 100;

[[noreturn]] void wrong(const std::string& why) { throw Error(ErrorKind::kUsage, one_line(why)); }

/// The field of a parameter, by its own name or by that of proto3's JSON.
const FieldDescriptor& parameter(const ApiRoute& route, const std::string& name) {
  const google::protobuf::Descriptor& request = *route.call->input_type();
  const FieldDescriptor* field = request.FindFieldByName(name);
  if (!field) field = request.FindFieldByCamelcaseName(name);
  if (!field || field->message_type() || field == route.body_field || route.in_path(field->name()))
    wrong("\"" + name.substr(0, kMostQuoted) + "\" is no parameter of " + route.method + " " + route.path);
  return *field;
}

std::string json_to_bytes(const ApiDescription& description, const google::protobuf::Descriptor& message,
                          std::string_view json, const char* what) {
  std::string bytes;
  const auto status = google::protobuf::util::JsonToBinaryString(
      description.types(), ApiDescription::type_url(message), {json.data(), json.size()}, &bytes);
  if (!status.ok()) wrong(std::string(what) + ": " + status.message().ToString());
  return bytes;
}

std::string bytes_field(const FieldDescriptor& field, std::string_view value) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream out(&stream);
  out.WriteTag(google::protobuf::internal::WireFormatLite::MakeTag(
      field.number(), google::protobuf::internal::WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
  out.WriteVarint64(value.size());
  out.WriteRaw(value.data(), static_cast<int>(value.size()));
  out.Trim();
  return bytes;
}

}  // namespace

std::string request_bytes(const ApiDescription& description, const ApiMatch& match,
                          const std::multimap<std::string, std::string>& query, std::string_view body) {
  const ApiRoute& route = *match.route;
  const google::protobuf::Descriptor& request = *route.call->input_type();
  std::string bytes;
  if (route.body == ApiRoute::Body::kMessage && !body.empty()) {
    if (!is_utf8(body)) wrong("the body is not UTF-8");
    bytes = json_to_bytes(description, request, body, "the body");
  } else if (route.body == ApiRoute::Body::kBytes) {
    bytes = bytes_field(*route.body_field, body);
  }
  // Of a field with one value the last counts: so what the path says holds.
  auto parameters = nlohmann::json::object();
  for (const auto& [name, value] : query) {
    if (route.body == ApiRoute::Body::kMessage)
      wrong("\"" + name.substr(0, kMostQuoted) +
            "\": this call takes its fields in the body, not in the query");
    const FieldDescriptor& field = parameter(route, name);
    if (!is_utf8(value)) wrong("the parameter " + field.name() + " is not UTF-8");
    if (field.is_repeated()) {
      parameters[field.name()].push_back(value);
    } else if (!parameters.emplace(field.name(), value).second) {
      wrong("the parameter " + field.name() + " is given twice");
    }
  }
  for (const auto& [name, value] : match.fields) {
    if (!is_utf8(value)) wrong("the path is not UTF-8");
    parameters[name] = value;
  }
  if (!parameters.empty()) bytes += json_to_bytes(description, request, parameters.dump(), "the parameters");
  return bytes;
}

std::string message_json(const ApiDescription& description, const google::protobuf::Descriptor& message,
                         const std::string& bytes) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::BinaryToJsonString(
      description.types(), ApiDescription::type_url(message), bytes, &json, options);
  if (!status.ok()) throw std::runtime_error("an answer has no JSON: " + status.message().ToString());
  return json;
}

}  // namespace lightmill
