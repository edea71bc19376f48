// Sequences over the dashboard's JSON: the list, pages of frames, what changed since a version, and actions.
#include "coordinator/web/sequence_routes.h"

#include <gmock/gmock.h>

#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using nlohmann::json;
using ::testing::HasSubstr;

class SequenceRoutesTest : public WebApiTest {
 protected:
  std::string submit(int first, int last, const SequenceRequest& request = {}) {
    std::vector<FrameRequest> frames;
    for (int number = first; number <= last; ++number) {
      frames.push_back({number, fake_bundle(), small_settings(64, 64, 64)});
      frames.back().bundle.pose.time = number / 24.0;
    }
    return "/api/v1/sequences/" + farm.submit(request, frames).value;
  }
};

TEST_F(SequenceRoutesTest, ListsSequencesWithTheirProgress) {
  SequenceRequest request;
  request.name = "shot";
  request.fps = 12;
  const std::string first = submit(1, 3, request), second = submit(-2, 0);
  work(farm, farm.register_worker(registration()));
  const json list = get("/api/v1/sequences");
  EXPECT_EQ(list["total"], 2);
  const json& row = list["sequences"][0];
  EXPECT_EQ(row["id"], "s1");
  EXPECT_EQ(row["name"], "shot");
  EXPECT_EQ(row["fps"], 12);
  EXPECT_EQ(row["order"], "sequential");
  EXPECT_EQ(row["state"], "done");
  EXPECT_EQ(row["frame_count"], 3);
  EXPECT_EQ(row["frames"]["done"], 3);
  EXPECT_EQ(row["frames"]["failed"], 0);
  EXPECT_EQ(row["packets_done"], row["packets_total"]);
  EXPECT_GE(row["relmse_max"], row["relmse_mean"]);
  EXPECT_EQ(get("/api/v1/sequences?begin=1&count=5")["sequences"][0]["first_frame"], -2);
  EXPECT_EQ(get(second)["sequence"]["id"], "s2");
  get("/api/v1/sequences?begin=x", 400);
  get("/api/v1/sequences/s404", 404);
  get("/api/v1/sequences/s404/frames", 404);
  get("/api/v1/sequences/frames", 404);
}

TEST_F(SequenceRoutesTest, FramesComeInPagesAndWhatChangedSinceAVersion) {
  const std::string path = submit(-2, 4);
  const json first = get(path + "/frames?count=3");
  EXPECT_EQ(first["sequence"]["frame_count"], 7);
  EXPECT_EQ(first["total"], 7);
  ASSERT_EQ(first["frames"].size(), 3u);
  EXPECT_EQ(first["frames"][0]["number"], -2);
  EXPECT_EQ(first["frames"][0]["id"], "s1.-2");
  EXPECT_EQ(first["frames"][0]["state"], "queued");
  EXPECT_EQ(first["next"], 0);
  const json second = get(path + "/frames?count=3&after=0");
  EXPECT_FALSE(second.contains("sequence"));
  EXPECT_EQ(second["frames"][0]["number"], 1);
  const json last = get(path + "/frames?count=3&after=3");
  EXPECT_EQ(last["frames"].size(), 1u);
  EXPECT_FALSE(last.contains("next"));

  const std::string since = "/frames?since=" + first["sequence"]["version"].dump();
  EXPECT_TRUE(get(path + since)["frames"].empty());
  farm.pause(JobId{"s1.3"});
  const json changed = get(path + since);
  ASSERT_EQ(changed["frames"].size(), 1u);
  EXPECT_EQ(changed["frames"][0]["number"], 3);
  EXPECT_EQ(changed["frames"][0]["state"], "paused");
  EXPECT_GT(changed["sequence"]["version"], first["sequence"]["version"]);
  EXPECT_EQ(changed["total"], 7);
  for (const char* bad : {"after=x", "after=", "after=1x", "after=99999999999", "since=-1", "count=a"})
    get(path + "/frames?" + bad, 400);
}

TEST_F(SequenceRoutesTest, ActionsChangeAllFramesAndAreLogged) {
  const std::string path = submit(1, 4);
  EXPECT_EQ(post(path + "/pause", json::object())["sequence"]["frames"]["paused"], 4);
  EXPECT_THAT(events.after(0).back().text, HasSubstr("sequence s1: pause by a browser at 127.0.0.1"));
  post(path + "/pause", json::object(), 409);
  EXPECT_EQ(post(path + "/resume", json::object())["sequence"]["state"], "queued");
  EXPECT_EQ(post(path + "/priority", {{"priority", -3}})["sequence"]["priority"], -3);
  post(path + "/extend", {{"spp", 128}, {"target_error", 0.01}});
  EXPECT_EQ(farm.job(JobId{"s1.4"}).settings.spp, 128);
  EXPECT_EQ(farm.job(JobId{"s1.4"}).settings.target_error, 0.01);
  EXPECT_EQ(post(path + "/cancel", json::object())["sequence"]["state"], "cancelled");
  EXPECT_EQ(post(path + "/retry", json::object())["sequence"]["state"], "queued");
  EXPECT_EQ(events.after(0).size(), 6u) << "what was refused did not happen";

  post(path + "/extend", json::object(), 400);
  post(path + "/extend", {{"spp", 0}}, 400);
  post(path + "/priority", {{"priority", 1e300}}, 400);
  post(path + "/pause", {{"now", true}}, 400);
  post("/api/v1/sequences/s404/pause", json::object(), 404);
  EXPECT_EQ(http.Post(path + "/resubmit")->status, 404);
  post(path + "/pause", json::object(), 403, {});
  post(path + "/pause", json::object(), 403, {{"X-Lightmill", "1"}, {"Origin", "http://evil.example"}});
  EXPECT_EQ(farm.sequence(SequenceId{"s1"}).state, JobState::kQueued);
}

TEST_F(SequenceRoutesTest, FramesAreNoRowsAmongTheJobs) {
  submit(1, 4);
  const JobId single = farm.submit(small_job(64, 64, 4));
  const JobPage page = farm.page(0, 100, 0, true, false);
  EXPECT_EQ(page.total, 5u);
  ASSERT_EQ(page.jobs.size(), 1u);
  EXPECT_EQ(page.jobs[0].id, single);
  EXPECT_EQ(farm.page(0, 100, 0, true).jobs.size(), 5u);
  EXPECT_EQ(get("/api/v1/jobs/s1.2")["id"], "s1.2") << "each has its own page";
}

}  // namespace
}  // namespace lightmill
