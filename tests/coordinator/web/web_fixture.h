#pragma once
// A coordinator in this process, asked over real HTTP.
#include <gtest/gtest.h>
#include <httplib.h>

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "coordinator/server.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

class WebApiTest : public ::testing::Test {
 protected:
  WebApiTest()
      : blobs(folder.file("blobs")),
        farm(std::make_unique<MemoryJobStore>(), clock, fake_options()),
        server(std::make_unique<Server>(ServerOptions{.listen = "127.0.0.1:0",
                                                      .http = "127.0.0.1:0",
                                                      .log = [this](const std::string& l) { events.add(l); },
                                                      .quotas = quotas(),
                                                      .events = &events,
                                                      .read_scene = read_scene,
                                                      .tile_log = &tile_log},
                                        farm, blobs)),
        http("127.0.0.1", server->http_port()) {
    http.set_read_timeout(30);
  }
  static Quotas quotas() {
    Quotas small;
    small.max_pixels = 1 << 20;
    small.max_bundle_bytes = 4 << 20;
    return small;
  }
  nlohmann::json get(const std::string& path, int status = 200) {
    const auto response = http.Get(path);
    if (!response) {
      ADD_FAILURE() << path << ": " << httplib::to_string(response.error());
      return {};
    }
    EXPECT_EQ(response->status, status) << path << ": " << response->body;
    return nlohmann::json::parse(response->body, nullptr, false);
  }
  nlohmann::json post(const std::string& path, const nlohmann::json& body, int status = 200,
                      const httplib::Headers& headers = {{"X-Lightmill", "1"}}) {
    const auto response = http.Post(path, headers, body.dump(), "application/json");
    if (!response) {
      ADD_FAILURE() << path << ": " << httplib::to_string(response.error());
      return {};
    }
    EXPECT_EQ(response->status, status) << path << ": " << response->body;
    return nlohmann::json::parse(response->body, nullptr, false);
  }
  TemporaryFolder folder;
  SteadyClock clock;
  BlobStore blobs;
  EventLog events;
  TileLog tile_log;
  Farm farm;
  std::unique_ptr<Server> server;
  httplib::Client http;
};

}  // namespace lightmill::testing
