// The HTTP API of a coordinator in this process, over real HTTP.
#include "coordinator/http_api/http_api.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "common/base/digest.h"
#include "common/rpc/request_limits.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using nlohmann::json;
using ::testing::HasSubstr;

constexpr const char* kScene = R"(Film "rgb" "integer xresolution" 64 "integer yresolution" 48
Sampler "sobol" "integer pixelsamples" 9
WorldBegin
LightSource "infinite"
Include "parts\\ball.pbrt"
)";
constexpr const char* kPart = "Material \"diffuse\"\nShape \"sphere\"\n";

class HttpApiTest : public WebApiTest {
 protected:
  /// Without the header that the dashboard needs.
  json call(const std::string& path, const json& body, int status = 200) {
    return post(path, body, status, {});
  }
  static std::string why(const json& error) { return error.value("message", std::string()); }
  std::vector<json> lines(const std::string& path) {
    const auto response = http.Get(path);
    std::vector<json> all;
    EXPECT_TRUE(response && response->status == 200) << path;
    if (!response) return all;
    EXPECT_EQ(response->get_header_value("Content-Type"), "application/x-ndjson");
    for (size_t begin = 0; begin < response->body.size();) {
      const size_t end = response->body.find('\n', begin);
      all.push_back(json::parse(response->body.substr(begin, end - begin)));
      begin = end + 1;
    }
    return all;
  }
  json put(const std::string& digest, size_t size, size_t offset, const std::string& bytes,
           int status = 200) {
    const auto response = http.Put(
        "/v1/blobs/" + digest + "?size=" + std::to_string(size) + "&offset=" + std::to_string(offset), bytes,
        "application/octet-stream");
    if (!response) {
      ADD_FAILURE() << httplib::to_string(response.error());
      return {};
    }
    EXPECT_EQ(response->status, status) << response->body;
    return json::parse(response->body);
  }
  json upload(const std::string& name, const std::string& text) {
    EXPECT_EQ(put(sha256_hex(text), text.size(), 0, text),
              json({{"received", std::to_string(text.size())}, {"complete", true}}));
    return {{"name", name}, {"digest", sha256_hex(text)}, {"size", text.size()}};
  }
};

TEST_F(HttpApiTest, JobsAreReadAndControlled) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  const std::string path = "/v1/jobs/" + id.value;
  EXPECT_EQ(get(path)["job"]["state"], "JOB_STATE_QUEUED");
  EXPECT_EQ(get("/v1/jobs")["total_size"], 1);
  EXPECT_EQ(call(path + ":pause", json::object())["job"]["state"], "JOB_STATE_PAUSED");
  const json again = call(path + ":pause", json::object(), 400);
  EXPECT_EQ(again["code"], 9) << "FAILED_PRECONDITION";
  EXPECT_THAT(why(again), HasSubstr("is paused"));
  EXPECT_EQ(http.Post(path + ":resume")->status, 200) << "a body without bytes is an empty message";
  EXPECT_EQ(call(path + ":extend", {{"spp", "128"}})["job"]["id"], id.value);
  EXPECT_EQ(farm.job(id).settings.spp, 128);
  work(farm, farm.register_worker(registration()));
  EXPECT_EQ(get(path)["job"]["state"], "JOB_STATE_DONE");
  EXPECT_FALSE(get(path + "/curve")["curve"]["points"].empty());
  EXPECT_EQ(get("/v1/workers")["workers"].size(), 1u);
  const std::vector<json> tiles = lines(path + "/tiles");
  ASSERT_FALSE(tiles.empty());
  EXPECT_EQ(tiles[0]["result"]["tiles"][0]["state"], "TILE_STATE_COMMITTED");
  lines(path + "/logs?max_lines=10");
  EXPECT_EQ(get("/v1/jobs/j404", 404)["code"], 5);
  EXPECT_EQ(get("/v1/jobs/j404/tiles", 404)["code"], 5)
      << "a stream that does not begin is an error like any other";
  EXPECT_EQ(get("/v1/beds", 404)["code"], 5);
  const auto method = http.Delete(path);
  EXPECT_EQ(method->status, 405);
  EXPECT_EQ(method->get_header_value("Allow"), "GET");
}

TEST_F(HttpApiTest, JobsComeInPages) {
  for (int i = 0; i < 5; ++i) farm.submit(small_job(32, 32, 4));
  std::vector<std::string> ids;
  std::string token;
  do {
    const json page = get("/v1/jobs?page_size=2&page_token=" + token);
    for (const json& job : page["jobs"]) ids.push_back(job["id"]);
    token = page["next_page_token"];
  } while (!token.empty());
  EXPECT_THAT(ids, ::testing::ElementsAre("j1", "j2", "j3", "j4", "j5"));
  EXPECT_THAT(why(get("/v1/jobs?page_token=x", 400)), HasSubstr("page_token"));
}

TEST_F(HttpApiTest, AWatchIsALineAStateUntilTheEnd) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  std::atomic<int> seen{0};
  std::thread worker([&] {
    while (seen == 0) std::this_thread::yield();  // the first state comes before anything has happened
    work(farm, farm.register_worker(registration()));
  });
  std::string text;
  const auto response = http.Get("/v1/jobs/" + id.value + ":watch", [&](const char* data, size_t size) {
    text.append(data, size);
    ++seen;
    return true;
  });
  ++seen;
  worker.join();
  ASSERT_TRUE(response);
  EXPECT_EQ(json::parse(text.substr(0, text.find('\n')))["result"]["job"]["state"], "JOB_STATE_QUEUED");
  const size_t last = text.rfind('\n', text.size() - 2) + 1;
  EXPECT_EQ(json::parse(text.substr(last))["result"]["job"]["state"], "JOB_STATE_DONE");
}

TEST_F(HttpApiTest, AWatchEndsWithTheCoordinator) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  std::atomic<bool> began{false};
  std::string text;
  std::thread watcher([&] {
    http.Get("/v1/jobs/" + id.value + ":watch", [&](const char* data, size_t size) {
      text.append(data, size);
      began = true;
      return true;
    });
  });
  while (!began) std::this_thread::yield();
  server.reset();  // hangs if the stream does not end
  watcher.join();
  EXPECT_THAT(text, HasSubstr("\"result\""));
}

TEST_F(HttpApiTest, ScenesAreUploadedCheckedAndSubmitted) {
  const json main = upload("scene.pbrt", kScene);
  json scene{{"main", "scene.pbrt"}, {"files", {main}}};
  json said = call("/v1/scenes:check", scene);
  ASSERT_EQ(said["missing"].size(), 1u) << said;
  EXPECT_EQ(said["missing"][0]["reference"], "parts\\ball.pbrt");
  EXPECT_THAT(std::string(said["errors"][0]), HasSubstr("scene.pbrt:5:"));
  EXPECT_THAT(why(call("/v1/scenes:submit", scene, 400)), HasSubstr("ball.pbrt"));
  EXPECT_EQ(call("/v1/blobs:missing", {{"digests", {main["digest"], sha256_hex(kPart)}}})["digests"],
            json({sha256_hex(kPart)}));
  scene["files"].push_back(upload(said["missing"][0]["name"], kPart));
  said = call("/v1/scenes:check", scene);
  EXPECT_EQ(said["errors"], json::array());
  EXPECT_EQ(said["width"], 64);
  EXPECT_EQ(said["spp"], "9");
  EXPECT_EQ(said["files"], "2");
  EXPECT_EQ(settings_from_json(said["settings_json"]).spp, 9);
  scene.update({{"name", "by HTTP"},
                {"spp", 33},
                {"crop", {{"x0", 0.25}, {"x1", 0.75}, {"y0", 0}, {"y1", 1}}},
                {"integrator", "pt"},
                {"uniform_sampling", true},
                {"priority", -4}});
  const JobStatus job = farm.job(JobId{call("/v1/scenes:submit", scene)["job_id"]});
  EXPECT_EQ(job.name, "by HTTP");
  EXPECT_EQ(job.settings.spp, 33);
  EXPECT_EQ(job.settings.grid.crop.x0, 16);
  EXPECT_EQ(job.settings.grid.crop.x1, 48);
  EXPECT_EQ(job.settings.grid.width, 64) << "as the scene says";
  EXPECT_TRUE(job.settings.uniform_sampling);
  EXPECT_EQ(job.priority, -4);
  // A ready bundle with settings.
  const json again = call("/v1/jobs", {{"name", "ready"},
                                       {"bundle_json", bundle_to_json(farm.bundle(job.bundle_digest))},
                                       {"settings_json", settings_to_json(job.settings)}});
  EXPECT_EQ(farm.job(JobId{again["job_id"]}).bundle_digest, job.bundle_digest);
  for (const json& wrong : std::vector<json>{{{"spp", 0}},
                                             {{"width", -1}},
                                             {{"crop", {{"x0", 2}}}},
                                             {{"crop", json::object()}},
                                             {{"integrator", "magic"}},
                                             {{"max_workers", -1}},
                                             {{"time_seconds", "Infinity"}},
                                             {{"shutter_opens", 1}},
                                             {{"aovs", "beauty"}}}) {
    json bad = scene;
    bad.update(wrong);
    EXPECT_EQ(call("/v1/scenes:submit", bad, 400)["code"], 3) << wrong;
  }
}

TEST_F(HttpApiTest, UploadsGoOnWhereTheyStopped) {
  const std::string text(3000, 'a'), digest = sha256_hex(text);
  EXPECT_EQ(put(digest, 3000, 0, text.substr(0, 1000))["received"], "1000");
  EXPECT_EQ(put(digest, 3000, 0, "")["received"], "1000") << "one without bytes asks";
  EXPECT_EQ(put(digest, 3000, 500, text.substr(0, 1000))["received"], "1000")
      << "what does not go on changes nothing";
  EXPECT_EQ(put(digest, 3000, 1000, text.substr(1000))["complete"], true);
  EXPECT_EQ(put(digest, 3000, 0, "")["complete"], true);
  EXPECT_EQ(put(sha256_hex(""), 0, 0, "")["complete"], true);
  EXPECT_EQ(put(sha256_hex("x"), 1, 0, "y", 400)["code"], 3) << "another content";
  EXPECT_EQ(put("zz", 1, 0, "y", 400)["code"], 3);
  EXPECT_EQ(put(sha256_hex("x"), size_t{5} << 20, 0, "y", 429)["code"], 8) << "beyond --max-bundle-mb";
}

TEST_F(HttpApiTest, PicturesAreFiles) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  work(farm, farm.register_worker(registration()));
  const std::string path = "/v1/jobs/" + id.value + "/image";
  const Image image = farm.image(id);
  const auto raw = http.Get(path + "?format=raw");
  ASSERT_TRUE(raw);
  ASSERT_EQ(raw->body.substr(0, 4), "LMF2");
  uint32_t head[4];
  std::memcpy(head, raw->body.data() + 4, sizeof head);
  EXPECT_THAT(head, ::testing::ElementsAre(96u, 64u, 3u, 5u));
  EXPECT_EQ(raw->body.substr(20, 5), "R\nG\nB");
  ASSERT_EQ(raw->body.size(), 25 + 4 * image.data.size());
  EXPECT_EQ(std::memcmp(raw->body.data() + 25, image.data.data(), 4 * image.data.size()), 0)
      << "the same bits";
  const auto exr = http.Get(path);
  EXPECT_EQ(exr->body.substr(0, 4), "v/1\x01");
  EXPECT_EQ(exr->get_header_value("Content-Type"), "image/x-exr");
  EXPECT_EQ(exr->get_header_value("Content-Disposition"), "attachment; filename=\"" + id.value + ".exr\"");
  EXPECT_EQ(http.Get(path + "?format=png")->body.substr(1, 3), "PNG");
  EXPECT_NE(http.Get(path + "?format=png&view=filmic&exposure=-1")->body,
            http.Get(path + "?format=png")->body);
  const auto small = http.Get(path + "?format=raw&max_side=48");
  EXPECT_EQ(small->body.size(), 25u + 4 * 3 * 48 * 32);
  for (const char* bad :
       {"format=gif", "format=png&view=sepia", "exposure=101", "max_side=-1", "exposure=NaN",
        "with_aovs=true&max_side=9", "format=png&with_aovs=true", "max_side=x"})
    EXPECT_EQ(http.Get(path + "?" + bad)->status, 400) << bad;
  EXPECT_EQ(http.Get("/v1/jobs/j404/image")->status, 404);
  EXPECT_EQ(http.Head(path)->status, 200);
  EXPECT_EQ(http.Get(path, {{"Range", "bytes=5-"}})->status, 416);
}

TEST_F(HttpApiTest, BodiesAreBoundedBeforeTheyAreUnpacked) {
  const JobId id = farm.submit(small_job(32, 32, 4));
  const std::string path = "/v1/jobs/" + id.value + ":extend";
  const auto large = http.Post(path, "{\"spp\":" + std::string(20000, ' ') + "8}", "application/json");
  ASSERT_TRUE(large);
  EXPECT_EQ(large->status, 413) << large->body;
  EXPECT_THAT(why(json::parse(large->body)), HasSubstr("it may have 16384"));
  for (const char* rest : {"", ":watch", "/tiles", "/image", "/logs?max_lines=1"}) {
    const auto response = http.Get("/v1/jobs/" + std::string(5000, 'j') + rest);
    EXPECT_EQ(response->status, 429) << rest;
    EXPECT_THAT(response->body, HasSubstr("it may have 4096")) << rest;
  }
  // Within the body's bound, and beyond that of the message.
  const auto id_bomb =
      http.Post("/v1/jobs/x:pause", R"({"job_id":")" + std::string(10000, 'j') + "\"}", "application/json");
  EXPECT_EQ(id_bomb->status, 429);
  EXPECT_THAT(id_bomb->body, HasSubstr("4096"));
  std::string many = "{\"files\":[";
  for (int i = 0; i < 52000; ++i) many += i > 0 ? ",{}" : "{}";
  EXPECT_EQ(http.Post("/v1/scenes:check", many + "]}", "application/json")->status, 429);
  EXPECT_EQ(http.Post(path, "{}", "text/plain")->status, 415);
  EXPECT_EQ(http.Post(path, httplib::Headers{{"Content-Encoding", "gzip"}}, "{}", "application/json")->status,
            415);
  EXPECT_EQ(http.Post(path, httplib::MultipartFormDataItems{{"a", "b", "c", "d"}})->status, 415);
  EXPECT_EQ(put(sha256_hex("x"), 3 << 20, 0, std::string((1 << 20) + 1, 'x'), 400)["code"], 3);
  EXPECT_EQ(http.Get("/v1/jobs?page_token=" + std::string(7000, 'a'))->status, 429);
  EXPECT_EQ(get("/v1/jobs/" + id.value)["job"]["state"], "JOB_STATE_QUEUED")
      << "the connection is still in step";
}

TEST_F(HttpApiTest, OneCallerHasSoManyCalls) {
  const JobId id = farm.submit(small_job(32, 32, 4));
  std::atomic<bool> stop{false};
  std::atomic<int> began{0};
  std::vector<std::thread> watchers;
  for (int i = 0; i < HttpApi::kMaxCallsOfCaller; ++i) {
    watchers.emplace_back([&] {
      httplib::Client own("127.0.0.1", server->http_port());
      own.set_read_timeout(30);
      bool first = true;
      own.Get("/v1/jobs/" + id.value + ":watch", [&](const char*, size_t) {
        if (std::exchange(first, false)) ++began;
        return !stop;
      });
    });
  }
  while (began < HttpApi::kMaxCallsOfCaller) std::this_thread::yield();
  const auto refused = http.Get("/v1/jobs");
  EXPECT_EQ(refused->status, 429);
  EXPECT_EQ(refused->get_header_value("Retry-After"), "1");
  EXPECT_EQ(http.Get("/livez")->status, 200) << "others are served";
  EXPECT_EQ(get("/api/v1/jobs")["total"], 1);
  stop = true;
  for (std::thread& watcher : watchers) watcher.join();
  httplib::Result later = http.Get("/v1/jobs");
  while (later->status == 429) later = http.Get("/v1/jobs");  // the places are given back
  EXPECT_EQ(later->status, 200);
}

TEST_F(HttpApiTest, OtherSitesCanDoNothingHere) {
  const JobId id = farm.submit(small_job(32, 32, 4));
  const std::string path = "/v1/jobs/" + id.value + ":cancel";
  post(path, json::object(), 403, {{"Origin", "http://evil.example"}});
  post(path, json::object(), 403, {{"Origin", "null"}});
  post(path, json::object(), 403, {{"Sec-Fetch-Site", "cross-site"}});
  post(path, json::object(), 403, {{"Host", "evil.example"}});
  EXPECT_EQ(http.Get("/v1/jobs", {{"Host", "evil.example"}})->status, 403);
  EXPECT_FALSE(http.Get("/v1/jobs")->has_header("Access-Control-Allow-Origin"));
  EXPECT_EQ(farm.job(id).state, JobState::kQueued);
}

TEST_F(HttpApiTest, DescribesItself) {
  const json document = get("/v1/openapi.json");
  EXPECT_TRUE(document["paths"].contains("/v1/jobs/{job_id}:watch"));
}

}  // namespace
}  // namespace lightmill
