// The dashboard's side of the coordinator over real HTTP: JSON, pictures and actions.
#include "coordinator/web/web_api.h"

#include <gmock/gmock.h>

#include <cstring>
#include <thread>

#include "common/base/digest.h"
#include "coordinator/access/access.h"
#include "coordinator/web/json_views.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(WebApiTest, EveryRouteHasRoles) {
  const WebApi api({farm, blobs, events});
  size_t acting = 0;
  for (const WebApi::Route& route : api.routes()) {
    const AccessRule* const rule = access_rule(route.path);
    ASSERT_NE(rule, nullptr) << route.path << " has no line in coordinator/access/access.cc";
    EXPECT_FALSE(rule->everybody) << route.path;
    EXPECT_FALSE(may(*rule, Role::kWorker)) << route.path;
    EXPECT_EQ(may(*rule, Role::kObserver), route.method == "GET") << route.path;
    EXPECT_TRUE(may(*rule, Role::kSubmitter) && may(*rule, Role::kAdmin)) << route.path;
    if (route.method != "GET") ++acting;
  }
  EXPECT_EQ(acting, 16u);
  EXPECT_EQ(access_rule("/api/v1/jobs/j1/pause"), access_rule("/api/v1/jobs/*/pause"));
  EXPECT_EQ(access_rule("/api/v1/jobs/j1/x/pause"), nullptr);
  EXPECT_EQ(access_rule("/api/v1/jobs//pause"), nullptr);
  EXPECT_EQ(access_rule("/api/v1/jobs/"), nullptr);
  EXPECT_EQ(access_rule("/assets/../secret"), nullptr);
}

TEST_F(WebApiTest, JobsWorkersCurveAndTiles) {
  JobRequest request = small_job(96, 64, 64, Integrator::kPt);
  request.name = "bad \xff name";
  const JobId done = farm.submit(request);
  const WorkerId worker = farm.register_worker(registration());
  work(farm, worker);
  const JobId open = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  const LeaseGrant held = farm.lease(worker).value();

  const json list = get("/api/v1/jobs");
  EXPECT_EQ(list["total"], 2);
  EXPECT_EQ(list["jobs"][0]["id"], done.value);
  EXPECT_EQ(list["jobs"][0]["state"], "done");
  EXPECT_EQ(list["jobs"][0]["name"], "bad \xef\xbf\xbd name");  // U+FFFD
  EXPECT_EQ(list["jobs"][1]["tiles_leased"], 1);
  EXPECT_EQ(get("/api/v1/jobs?begin=1&count=5")["jobs"].size(), 1u);
  get("/api/v1/jobs?begin=-1", 400);

  const json job = get("/api/v1/jobs/" + done.value);
  EXPECT_EQ(job["spp"], 64);
  EXPECT_EQ(job["detail"]["settings"]["seed"], 0);
  EXPECT_EQ(job["detail"]["crop"], json({0, 0, 96, 64}));
  const json curve = get("/api/v1/jobs/" + done.value + "/curve");
  ASSERT_FALSE(curve.empty());
  EXPECT_EQ(curve.back()["spp"], 64);
  EXPECT_GT(curve.back()["relmse_high"], curve.back()["relmse"]);

  const json tiles = get("/api/v1/jobs/" + open.value + "/tiles");
  EXPECT_EQ(tiles["complete_samples"], 0);
  EXPECT_EQ(tiles["tiles"][held.tile_id.value]["state"], "leased");
  EXPECT_EQ(tiles["tiles"][held.tile_id.value]["worker"], worker.value);
  EXPECT_GE(tiles["tiles"][held.tile_id.value]["leased_seconds"], 0);
  const json ended = get("/api/v1/jobs/" + done.value + "/tiles");
  EXPECT_EQ(ended["complete_samples"], 64);
  for (const json& tile : ended["tiles"])
    EXPECT_EQ(tile["samples"][1], 64) << "only the last round is wanted";

  const json workers = get("/api/v1/workers");
  ASSERT_EQ(workers.size(), 1u);
  EXPECT_EQ(workers[0]["state"], "rendering");
  EXPECT_EQ(workers[0]["held"][0], json({open.value, held.tile_id.value, 1}));
  EXPECT_THAT(std::string(get("/api/v1/jobs/j404", 404)["error"]), HasSubstr("no job \"j404\""));

  farm.register_worker(registration());
  const json timeline = get("/api/v1/workers/timeline");
  ASSERT_EQ(timeline["workers"].size(), 2u);
  const json& spans = timeline["workers"][0]["spans"];
  ASSERT_FALSE(spans.empty());
  EXPECT_TRUE(spans[0][0] == done.value || spans[0][0] == open.value);
  EXPECT_GE(timeline["cell"], spans[0][1]);
  EXPECT_GT(timeline["workers"][0]["busy_seconds"], 0);
  EXPECT_TRUE(timeline["workers"][1]["spans"].empty());
  EXPECT_FALSE(timeline.contains("next"));
  const json page = get("/api/v1/workers/timeline?count=1");
  EXPECT_EQ(page["next"], worker.value);
  EXPECT_EQ(get("/api/v1/workers/timeline?after=" + worker.value)["workers"].size(), 1u);
  const int64_t later = timeline["cell"].get<int64_t>() + 100;
  EXPECT_TRUE(get("/api/v1/workers/timeline?since=" + std::to_string(later))["workers"][0]["spans"].empty());
  get("/api/v1/workers/timeline?since=x", 400);
}

TEST(JsonViews, RowsAndPointsHaveTheErrorAtSeveralScalesWhereItIsKnown) {
  JobStatus job;
  EXPECT_FALSE(job_view(job).contains("relmse_4"));
  job.boxes = {BoxError{0.1, 0.05, 0.2, {}}, BoxError{0.3, {}, {}, {}}, BoxError{}};
  const json row = job_view(job);
  EXPECT_EQ(row["relmse_4"], 0.1);
  EXPECT_EQ(row["relmse_4_low"], 0.05);
  EXPECT_EQ(row["relmse_4_high"], 0.2);
  EXPECT_EQ(row["relmse_16"], 0.3);
  EXPECT_FALSE(row.contains("relmse_16_low"));
  EXPECT_FALSE(row.contains("relmse_32"));
  ErrorCurve curve;
  curve.points.emplace_back();
  curve.points[0].boxes[2] = {0.5, {}, {}, 0.75};
  const json point = curve_view(curve)[0];
  EXPECT_EQ(point["relmse_32"], 0.5);
  EXPECT_EQ(point["true_relmse_32"], 0.75);
  EXPECT_FALSE(point.contains("relmse_4"));
}

TEST(JsonViews, RowsHaveWhatWasDroppedByKind) {
  JobStatus job;
  EXPECT_FALSE(job_view(job).contains("dropped") || job_view(job).contains("dropped_lines"));
  job.counters.nonfinite = 3;
  job.dropped[1] = {3, 0.25};
  job.dropped[4] = {9, std::nullopt};
  const json row = job_view(job);
  EXPECT_EQ(row["dropped"],
            json::parse(R"({"negative":{"count":3,"share":0.25},"below_range":{"count":9}})"));
  ASSERT_EQ(row["dropped_lines"].size(), 1u);
  EXPECT_EQ(row["dropped_lines"][0]["warning"], true);
  EXPECT_EQ(row["nonfinite"], 3);
}

TEST_F(WebApiTest, TheLogOfATileTellsItsAttempts) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  for (const int64_t tile : {3, 4}) {
    const LogScope scope({job.value, tile, 2, "w1"});
    tile_log.add("tile " + std::to_string(tile) + " \xff");
  }
  const std::string path = "/api/v1/jobs/" + job.value + "/log";
  EXPECT_EQ(get(path).size(), 2u);
  const json lines = get(path + "?tile=4");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0]["tile"], 4);
  EXPECT_EQ(lines[0]["attempt"], 2);
  EXPECT_EQ(lines[0]["worker"], "w1");
  EXPECT_EQ(lines[0]["text"], "tile 4 \xef\xbf\xbd");
  EXPECT_EQ(get(path + "?count=1")[0]["tile"], 4) << "the newest";
  get(path + "?tile=x", 400);
  get("/api/v1/jobs/j404/log", 404);
}

TEST_F(WebApiTest, PicturesAreTheFilm) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  work(farm, farm.register_worker(registration()));
  const auto picture = http.Get("/api/v1/jobs/" + id.value + "/image");
  ASSERT_TRUE(picture);
  ASSERT_EQ(picture->status, 200);
  const Image image = farm.image(id);
  ASSERT_EQ(picture->body.size(), 16 + 2 * image.data.size());
  EXPECT_EQ(picture->body.substr(0, 4), "LMH1");
  uint32_t head[3];
  std::memcpy(head, picture->body.data() + 4, sizeof head);
  EXPECT_THAT(head, ::testing::ElementsAre(96u, 64u, 3u));
  for (size_t i = 0; i < image.data.size(); i += 97) {
    uint16_t bits;
    std::memcpy(&bits, picture->body.data() + 16 + 2 * i, 2);
    const double value = std::ldexp(1 + (bits & 1023) / 1024.0, (bits >> 10) - 15);
    EXPECT_NEAR(value, static_cast<double>(image.data[i]), 1e-3 * value) << i;
  }
  EXPECT_EQ(http.Get("/api/v1/jobs/" + id.value + "/image?side=48")->body.size(), 16u + 2 * 3 * 48 * 32);
  EXPECT_EQ(http.Get("/api/v1/jobs/" + id.value + "/image?side=x")->status, 400);
  const std::string png = "/api/v1/jobs/" + id.value + "/image.png";
  EXPECT_EQ(http.Get(png)->body.substr(1, 3), "PNG");
  EXPECT_EQ(http.Get(png + "?view=srgb&exposure=0")->body, http.Get(png)->body);
  EXPECT_NE(http.Get(png + "?view=filmic&exposure=-1.5")->body, http.Get(png)->body);
  for (const char* bad :
       {"view=sepia", "exposure=bright", "exposure=101", "exposure=nan", "exposure=1x", "exposure="})
    EXPECT_EQ(http.Get(png + "?" + bad)->status, 400) << bad;
  EXPECT_EQ(http.Get("/api/v1/jobs/" + id.value + "/image.exr")->body.substr(0, 4), "v/1\x01");
  EXPECT_EQ(http.Get("/api/v1/jobs/" + id.value + "/error-map")->body.size(), 16u + 4 * 24 * 16);
  EXPECT_EQ(http.Get("/api/v1/jobs/j404/image")->status, 404);

  // Who looks often gets the picture of a moment ago, and is told.
  const JobId other = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  const std::string path = "/api/v1/jobs/" + other.value + "/image";
  const WorkerId worker = farm.register_worker(registration());
  const auto first = http.Get(path);
  EXPECT_FALSE(first->has_header("X-Lightmill-Stale"));
  ASSERT_EQ(work(farm, worker, 1), 1);
  httplib::Result next = http.Get(path);
  if (next->has_header("X-Lightmill-Stale")) {
    EXPECT_EQ(next->body, first->body);
  }
  while (next->has_header("X-Lightmill-Stale")) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    next = http.Get(path);
  }
  EXPECT_NE(next->body, first->body);
}

TEST_F(WebApiTest, ActionsActAndAreLogged) {
  const JobId id = farm.submit(small_job(64, 64, 20));
  const std::string path = "/api/v1/jobs/" + id.value;
  EXPECT_EQ(post(path + "/pause", json::object())["job"]["state"], "paused");
  EXPECT_THAT(std::string(post(path + "/pause", json::object(), 409)["error"]), HasSubstr("is paused"));
  EXPECT_EQ(post(path + "/resume", json::object())["job"]["state"], "queued");
  EXPECT_EQ(post(path + "/extend", {{"spp", 100}, {"target_error", 0.01}})["job"]["spp_total"], 100);
  EXPECT_EQ(farm.job(id).settings.target_error, 0.01);
  EXPECT_EQ(post(path + "/priority", {{"priority", -3}})["job"]["priority"], -3);
  EXPECT_EQ(farm.job(id).priority, -3);
  post(path + "/extend", json::object(), 400);
  post(path + "/extend", {{"spp", 1e300}}, 400);
  post(path + "/extend", {{"spp", 4}, {"sp", 4}}, 400);
  post(path + "/priority", {{"priority", "high"}}, 400);
  post(path + "/pause", json::array(), 400);
  post("/api/v1/jobs/j404/pause", json::object(), 404);
  EXPECT_EQ(post(path + "/cancel", json::object())["job"]["state"], "cancelled");
  post(path + "/priority", {{"priority", 1}}, 409);
  EXPECT_THAT(events.after(0).front().text,
              HasSubstr("job " + id.value + ": pause by a browser at 127.0.0.1"));
  EXPECT_EQ(get("/api/v1/log").size(), 5u) << "what was refused did not happen";
  EXPECT_EQ(get("/api/v1/log?after=4").size(), 1u);
}

TEST_F(WebApiTest, APriorityCountsFromTheNextLeaseOn) {
  const JobId first = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  const JobId second = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  const WorkerId worker = farm.register_worker(registration());
  for (int i = 0; i < 3; ++i) {
    const JobId& wanted = i % 2 == 0 ? first : second;
    const JobId& other = i % 2 == 0 ? second : first;
    post("/api/v1/jobs/" + wanted.value + "/priority", {{"priority", 5}});
    post("/api/v1/jobs/" + other.value + "/priority", {{"priority", 0}});
    const auto grant = farm.lease(worker);
    ASSERT_TRUE(grant);
    EXPECT_EQ(grant->job, wanted);
    ASSERT_EQ(farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, fake_bytes(*grant)),
              CommitResult::kAccepted);
  }
  work(farm, worker);
  EXPECT_EQ(farm.job(first).state, JobState::kDone);
  EXPECT_EQ(farm.job(second).state, JobState::kDone);
}

TEST_F(WebApiTest, ASceneIsSubmittedAgainWithOtherSettings) {
  JobRequest request = small_job(64, 64, 20, Integrator::kAuto);
  const JobId id = farm.submit(request);
  work(farm, farm.register_worker(registration()));
  ASSERT_TRUE(farm.job(id).settings.plan);
  const std::string path = "/api/v1/jobs/" + id.value + "/resubmit";
  EXPECT_THAT(std::string(post(path, json::object(), 409)["error"]),
              HasSubstr("is not on the coordinator any more"));
  BlobStore::Writer writer = blobs.begin(sha256_hex("scene"), 5);
  writer.write("scene");
  writer.finish();
  const json made = post(path, {{"name", "again"}, {"spp", 32}, {"seed", 7}, {"priority", 2}})["job"];
  EXPECT_NE(made["id"], id.value);
  const JobStatus again = farm.job(JobId{made["id"]});
  EXPECT_EQ(again.name, "again");
  EXPECT_EQ(again.settings.spp, 32);
  EXPECT_EQ(again.settings.seed, 7u);
  EXPECT_EQ(again.priority, 2);
  EXPECT_EQ(again.bundle_digest, farm.job(id).bundle_digest);
  EXPECT_FALSE(again.settings.plan) << "the pilot chooses anew";
  EXPECT_EQ(get("/api/v1/jobs/" + id.value)["detail"]["pilot"]["features"][0]["reason"], "one <lamp>");
}

TEST_F(WebApiTest, OtherSitesCanDoNothing) {
  const JobId id = farm.submit(small_job(64, 64, 20));
  const std::string path = "/api/v1/jobs/" + id.value + "/cancel";
  const std::string here = "127.0.0.1:" + std::to_string(server->http_port());
  post(path, json::object(), 403, {});
  post(path, json::object(), 403, {{"X-Lightmill", "1"}, {"Origin", "http://evil.example"}});
  post(path, json::object(), 403, {{"X-Lightmill", "1"}, {"Origin", "null"}});
  post(path, json::object(), 403, {{"X-Lightmill", "1"}, {"Sec-Fetch-Site", "cross-site"}});
  // A foreign name that leads here makes another site the same origin.
  const httplib::Headers rebound = {
      {"X-Lightmill", "1"}, {"Host", "evil.example:80"}, {"Origin", "http://evil.example:80"}};
  EXPECT_THAT(std::string(post(path, json::object(), 403, rebound)["error"]), HasSubstr("loopback"));
  EXPECT_EQ(http.Get("/api/v1/jobs", {{"Host", "evil.example"}})->status, 403);
  EXPECT_EQ(http.Get("/healthz", {{"Host", "evil.example"}})->status, 200);
  EXPECT_EQ(farm.job(id).state, JobState::kQueued);
  const auto options = http.Options(path);
  EXPECT_TRUE(!options || !options->has_header("Access-Control-Allow-Origin"));
  post(path, json::object(), 200,
       {{"X-Lightmill", "1"}, {"Origin", "http://" + here}, {"Sec-Fetch-Site", "same-origin"}});
  EXPECT_EQ(farm.job(id).state, JobState::kCancelled);
}

TEST_F(WebApiTest, PagesBringAStrictPolicy) {
  const auto page = http.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->body, HasSubstr("<title>Lightmill"));
  EXPECT_THAT(page->body, Not(HasSubstr("<style")));
  EXPECT_THAT(page->body, Not(::testing::ContainsRegex("<script[^>]*>[^<]")));
  const std::string policy = page->get_header_value("Content-Security-Policy");
  EXPECT_THAT(policy, HasSubstr("default-src 'none'; script-src 'self'"));
  EXPECT_THAT(policy, Not(HasSubstr("unsafe")));
  EXPECT_EQ(page->get_header_value("X-Content-Type-Options"), "nosniff");
  const std::string tag = page->get_header_value("ETag");
  EXPECT_EQ(http.Get("/", {{"If-None-Match", tag}})->status, 304);
  EXPECT_EQ(http.Get("/assets/nothing.js")->status, 404);
}

}  // namespace
}  // namespace lightmill
