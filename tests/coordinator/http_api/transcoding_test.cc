// Routes from the protocol's own options, and requests and answers between HTTP and messages.
#include "coordinator/http_api/transcoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "common/base/error.h"
#include "common/rpc/request_limits.h"
#include "coordinator/access/access.h"
#include "coordinator/http_api/http_status.h"
#include "coordinator/http_api/openapi.h"
#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/thin_client.pb.h"

namespace lightmill {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const ApiDescription& protocol() {
  static const ApiDescription description;
  return description;
}
const ApiRoutes& api_routes() {
  static const ApiRoutes routes(protocol());
  return routes;
}

template <class Request>
Request parsed(const char* method, const std::string& path,
               const std::multimap<std::string, std::string>& query, const std::string& body) {
  const auto match = api_routes().find(method, path);
  Request request;
  if (!match) {
    ADD_FAILURE() << "no route " << method << " " << path;
    return request;
  }
  EXPECT_EQ(match->route->call->input_type()->full_name(), Request::descriptor()->full_name());
  EXPECT_TRUE(request.ParseFromString(request_bytes(protocol(), *match, query, body)));
  return request;
}

std::string refusal_of(const char* method, const std::string& path,
                       const std::multimap<std::string, std::string>& query, const std::string& body) {
  try {
    request_bytes(protocol(), api_routes().find(method, path).value(), query, body);
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage);
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  ADD_FAILURE() << method << " " << path << " " << body << " was taken";
  return "";
}

TEST(ApiRoutes, EveryRpcOfClientsHasOneOrSaysWhyNot) {
  const std::set<std::string> without = {"/lightmill.v1.ClientService/FetchImage",    // GetPicture
                                         "/lightmill.v1.ClientService/UploadBlobs"};  // PutBlob
  std::set<std::string> routed;
  for (const ApiRoute& route : api_routes().all()) routed.insert(route.rpc);
  for (const AccessRule& rule : access_rules()) {
    const std::string path(rule.path);
    if (!path.starts_with("/lightmill.v1.")) continue;
    const bool workers = path.starts_with("/lightmill.v1.WorkerService/");
    EXPECT_EQ(routed.contains(path), !workers && !without.contains(path)) << path;
  }
}

TEST(ApiRoutes, HaveTheRolesOfTheirRpcsAndALimit) {
  for (const ApiRoute& route : api_routes().all()) {
    const AccessRule* const rule = access_rule(route.rpc);
    ASSERT_NE(rule, nullptr) << route.path;
    EXPECT_FALSE(rule->everybody) << route.path;
    EXPECT_TRUE(request_limit(route.call->input_type()->full_name())) << route.path;
    EXPECT_TRUE(route.changes() || may(*rule, Role::kObserver)) << route.path;
    EXPECT_GT(route.deadline_seconds, 0) << route.path;
  }
}

TEST(ApiRoutes, PathsAreFoundByMethodSegmentsAndVerb) {
  const ApiRoutes& routes = api_routes();
  EXPECT_EQ(routes.find("GET", "/v1/jobs/j1")->route->rpc, "/lightmill.v1.ClientService/GetJob");
  EXPECT_EQ(routes.find("GET", "/v1/jobs/j1:watch")->route->rpc, "/lightmill.v1.ClientService/WatchJob");
  EXPECT_EQ(routes.find("POST", "/v1/jobs")->route->rpc, "/lightmill.v1.ClientService/SubmitJob");
  EXPECT_EQ(routes.find("GET", "/v1/jobs")->route->rpc, "/lightmill.v1.ClientService/ListJobs");
  const auto pause = routes.find("POST", "/v1/jobs/j1:pause");
  EXPECT_THAT(pause->fields, ::testing::ElementsAre(std::pair<std::string, std::string>("job_id", "j1")));
  for (const char* path :
       {"/v1/jobs/", "/v1/jobs/j1/", "/v1/jobs/j1:sleep", "/v1//jobs", "/v1/jobs/j1/x/tiles",
        "/v1/jobs/:watch", "/v2/jobs", "/v1", "v1/jobs", "", "/v1/Jobs"}) {
    EXPECT_FALSE(routes.find("GET", path)) << path;
  }
  EXPECT_FALSE(routes.find("PATCH", "/v1/jobs/j1"));
  EXPECT_EQ(routes.methods_of("/v1/jobs"), "GET, POST");
  EXPECT_EQ(routes.methods_of("/v1/jobs/j1:pause"), "POST");
  EXPECT_EQ(routes.methods_of("/v1/beds"), "");
}

TEST(Transcoding, FieldsComeFromPathQueryAndBody) {
  EXPECT_EQ(parsed<v1::GetJobRequest>("GET", "/v1/jobs/j7", {}, "").job_id(), "j7");
  const auto list =
      parsed<v1::ListJobsRequest>("GET", "/v1/jobs", {{"page_size", "10"}, {"pageToken", "job-5"}}, "");
  EXPECT_EQ(list.page_size(), 10);
  EXPECT_EQ(list.page_token(), "job-5");
  const auto extend = parsed<v1::ExtendJobRequest>("POST", "/v1/jobs/j7:extend", {},
                                                   R"({"spp": "64", "targetError": 0.5, "job_id": "j8"})");
  EXPECT_EQ(extend.job_id(), "j7") << "the path counts";
  EXPECT_EQ(extend.spp(), 64);
  EXPECT_EQ(extend.target_error(), 0.5);
  EXPECT_FALSE(extend.has_time_seconds());
  const std::string bytes("\0\xff\n\"", 4);
  const auto piece =
      parsed<v1::PutBlobRequest>("PUT", "/v1/blobs/ab", {{"size", "9"}, {"offset", "5"}}, bytes);
  EXPECT_EQ(piece.content(), bytes);
  EXPECT_EQ(piece.digest(), "ab");
  EXPECT_EQ(piece.size(), 9u);
  EXPECT_EQ(piece.offset(), 5u);
  const auto picture = parsed<v1::GetPictureRequest>(
      "GET", "/v1/jobs/j7/image", {{"with_aovs", "true"}, {"exposure", "-1.5"}, {"format", "raw"}}, "");
  EXPECT_TRUE(picture.with_aovs());
  EXPECT_EQ(picture.exposure(), -1.5);
  EXPECT_TRUE(parsed<v1::PauseJobRequest>("POST", "/v1/jobs/j7:pause", {}, "").job_id() == "j7");
}

TEST(Transcoding, WhatTheRequestDoesNotHaveIsRefusedInALine) {
  EXPECT_THAT(refusal_of("GET", "/v1/jobs", {{"page", "1"}}, ""), HasSubstr("\"page\" is no parameter"));
  EXPECT_THAT(refusal_of("GET", "/v1/jobs", {{"page_size", "many"}}, ""), HasSubstr("page_size"));
  EXPECT_THAT(refusal_of("GET", "/v1/jobs", {{"page_size", "1"}, {"page_size", "2"}}, ""),
              HasSubstr("twice"));
  EXPECT_THAT(refusal_of("GET", "/v1/jobs/j1", {{"job_id", "j2"}}, ""), HasSubstr("job_id"));
  EXPECT_THAT(refusal_of("PUT", "/v1/blobs/ab", {{"content", "YQ=="}}, ""), HasSubstr("content"));
  EXPECT_THAT(refusal_of("POST", "/v1/jobs/j1:extend", {{"spp", "1"}}, ""), HasSubstr("in the body"));
  for (const char* body : {"{", "[]", "7", "\"x\"", "{\"spp\": []}", "{\"spp\": 1e300}", "{\"sp\": 1}",
                           "{\"target_error\": \"x\"}", "{\"spp\": 1} {}", "\xff", "{\"spp\": 1.5}"}) {
    EXPECT_THAT(refusal_of("POST", "/v1/jobs/j1:extend", {}, body), HasSubstr("the body")) << body;
  }
  EXPECT_THAT(refusal_of("GET", "/v1/jobs/\xff", {}, ""), HasSubstr("UTF-8"));
  EXPECT_THAT(refusal_of("GET", "/v1/jobs", {{"page_token", "\xff"}}, ""), HasSubstr("UTF-8"));
  // Deep nesting ends in an error, not in the stack.
  EXPECT_NE(refusal_of("POST", "/v1/jobs", {}, std::string(1 << 20, '[')), "");
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "{\"reference\":";
  EXPECT_NE(refusal_of("POST", "/v1/jobs", {}, deep), "");
}

TEST(Transcoding, AnswersHaveEveryField) {
  v1::GetJobResponse answer;
  answer.mutable_job()->set_id("j1");
  answer.mutable_job()->set_state(v1::JOB_STATE_PAUSED);
  answer.mutable_job()->set_packets_done(int64_t{1} << 60);
  const json said = json::parse(
      message_json(protocol(), *api_routes().find("GET", "/v1/jobs/j1")->route->call->output_type(),
                   answer.SerializeAsString()));
  EXPECT_EQ(said["job"]["id"], "j1");
  EXPECT_EQ(said["job"]["state"], "JOB_STATE_PAUSED");
  EXPECT_EQ(said["job"]["packets_done"], "1152921504606846976") << "a double would lose digits";
  EXPECT_EQ(said["job"]["priority"], 0) << "zero is a value";
  EXPECT_FALSE(said["job"].contains("relmse")) << "absent is not zero";
  EXPECT_EQ(said["job"]["after"], json::array());
  EXPECT_FALSE(said.contains("pilot_json"));
}

TEST(HttpStatus, IsAsGoogleRpcCodeSays) {
  EXPECT_EQ(http_status(grpc::StatusCode::OK), 200);
  EXPECT_EQ(http_status(grpc::StatusCode::FAILED_PRECONDITION), 400);
  EXPECT_EQ(http_status(grpc::StatusCode::UNAUTHENTICATED), 401);
  EXPECT_EQ(http_status(grpc::StatusCode::RESOURCE_EXHAUSTED), 429);
  EXPECT_EQ(http_status(grpc::StatusCode::UNAVAILABLE), 503);
  EXPECT_EQ(http_status(grpc::StatusCode::DATA_LOSS), 500);
  const json body = json::parse(error_json({grpc::StatusCode::NOT_FOUND, "no \"job\"\nat all \xff"}));
  EXPECT_EQ(body["code"], 5);
  EXPECT_EQ(body["details"], json::array());
  EXPECT_EQ(std::string(body["message"]).find('\n'), std::string::npos);
}

/// Every "$ref" below.
void collect_references(const json& value, std::set<std::string>* found) {
  if (value.is_object() && value.contains("$ref")) found->insert(value["$ref"]);
  if (!value.is_structured()) return;
  for (const json& part : value) collect_references(part, found);
}

/// A schema object of OpenAPI 3.0, as far as ours go.
void expect_schema(const json& schema, const std::string& where) {
  ASSERT_TRUE(schema.is_object()) << where;
  if (schema.contains("$ref")) {
    EXPECT_EQ(schema.size(), 1u) << where << ": nothing counts beside a reference";
    return;
  }
  if (schema.contains("allOf")) {
    for (const json& part : schema["allOf"]) expect_schema(part, where);
    return;
  }
  const std::set<std::string> types = {"array", "boolean", "integer", "number", "object", "string"};
  EXPECT_TRUE(schema.contains("type") && types.contains(schema["type"])) << where << ": " << schema;
  if (schema["type"] == "array") expect_schema(schema.value("items", json()), where + " items");
  if (schema.contains("additionalProperties"))
    expect_schema(schema["additionalProperties"], where + " values");
  if (!schema.contains("properties")) return;
  for (const auto& [name, property] : schema["properties"].items())
    expect_schema(property, where + "." + name);
}

TEST(OpenApi, IsADocumentOfVersion3) {
  const json document = json::parse(openapi_text(api_routes()));
  EXPECT_THAT(std::string(document["openapi"]), ::testing::StartsWith("3.0."));
  for (const char* field : {"title", "version", "description"})
    EXPECT_TRUE(document["info"][field].is_string() && document["info"][field] != "") << field;
  std::set<std::string> references, operations;
  collect_references(document, &references);
  EXPECT_GT(references.size(), 20u);
  for (const std::string& reference : references) {
    ASSERT_TRUE(reference.starts_with("#/")) << reference;
    EXPECT_TRUE(document.contains(json::json_pointer(reference.substr(1)))) << reference;
  }
  for (const auto& [name, schema] : document["components"]["schemas"].items()) expect_schema(schema, name);
  size_t count = 0;
  for (const auto& [path, methods] : document["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      ++count;
      const std::string where = method + " " + path;
      EXPECT_TRUE((std::set<std::string>{"get", "put", "post", "delete"}.contains(method))) << where;
      EXPECT_TRUE(operations.insert(operation["operationId"]).second) << where;
      EXPECT_NE(operation["summary"], "") << where << ": the RPC has no comment";
      EXPECT_THAT(std::string(operation["description"]), HasSubstr("Role: ")) << where;
      for (const char* status : {"200", "default"})
        EXPECT_TRUE(operation["responses"].contains(status)) << where;
      EXPECT_TRUE(operation["responses"]["200"].contains("description")) << where;
      EXPECT_FALSE(method == "get" && operation.contains("requestBody")) << where;
      std::set<std::string> in_path;
      for (const json& parameter : operation.value("parameters", json::array())) {
        expect_schema(parameter["schema"], where);
        if (parameter["in"] != "path") continue;
        EXPECT_EQ(parameter["required"], true) << where;
        in_path.insert("{" + std::string(parameter["name"]) + "}");
      }
      for (size_t at = path.find('{'); at != std::string::npos; at = path.find('{', at + 1))
        EXPECT_EQ(in_path.erase(path.substr(at, path.find('}', at) + 1 - at)), 1u) << where;
      EXPECT_TRUE(in_path.empty()) << where;
    }
  }
  EXPECT_EQ(count, api_routes().all().size());
}

TEST(OpenApi, SaysWhatTheProtoFilesSay) {
  const json document = json::parse(openapi_text(api_routes()));
  const json& pause = document["paths"]["/v1/jobs/{job_id}:pause"]["post"];
  EXPECT_EQ(pause["summary"], "Stops leasing tiles of a job.");
  EXPECT_THAT(std::string(pause["description"]), HasSubstr("Role: submitter or admin."));
  const json& job = document["components"]["schemas"]["JobStatus"]["properties"];
  EXPECT_EQ(job["packets_done"]["type"], "string") << "64 bits, as proto3 JSON has them";
  EXPECT_EQ(job["priority"]["description"], "higher first");
  EXPECT_THAT(job["state"]["enum"].dump(), HasSubstr("JOB_STATE_DONE"));
  const json& watch = document["paths"]["/v1/jobs/{job_id}:watch"]["get"]["responses"]["200"]["content"];
  EXPECT_TRUE(watch.contains("application/x-ndjson"));
  const json& put = document["paths"]["/v1/blobs/{digest}"]["put"];
  EXPECT_TRUE(put["requestBody"]["content"].contains("application/octet-stream"));
}

}  // namespace
}  // namespace lightmill
