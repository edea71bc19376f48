#include "client/json_output.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/output.h"

namespace lightmill::client {
namespace {

JobStatus some_job() {
  JobStatus status;
  status.id = JobId{"j7"};
  status.name = "box";
  status.settings.grid = {64, 32, {0, 0, 64, 32}};
  status.packets_total = 10;
  return status;
}

TEST(JobJson, HasTheKeysOfTheContract) {
  const nlohmann::json job = job_to_json(some_job());
  for (const char* key :
       {"id", "state", "packets_done", "packets_total", "leases_reassigned", "spp", "wall_seconds",
        "cpu_seconds", "relmse", "relmse_low", "relmse_high", "nonfinite"}) {
    EXPECT_TRUE(job.contains(key)) << key;
  }
  EXPECT_EQ(job["id"], "j7");
  EXPECT_EQ(job["state"], "queued");
  EXPECT_TRUE(job["relmse"].is_null());  // unknown yet
  for (const char* key : {"relmse_4", "relmse_4_low", "relmse_4_high", "relmse_16", "relmse_16_low",
                          "relmse_16_high", "relmse_32", "relmse_32_low", "relmse_32_high"}) {
    EXPECT_TRUE(job.at(key).is_null()) << key;
  }
}

TEST(JobJson, HasWhatWasDroppedByKind) {
  JobStatus status = some_job();
  status.counters.nonfinite = 3;
  status.dropped[0] = {3, std::nullopt};
  status.dropped[3] = {5, 0.25};
  const nlohmann::json job = job_to_json(status);
  EXPECT_EQ(job["nonfinite"], 3);
  EXPECT_EQ(job["dropped"]["not_finite"], nlohmann::json::parse(R"({"count":3,"share":null})"));
  EXPECT_EQ(job["dropped"]["capped"], nlohmann::json::parse(R"({"count":5,"share":0.25})"));
  for (const char* kind : {"negative", "out_of_range", "below_range"})
    EXPECT_EQ(job["dropped"][kind], nlohmann::json::parse(R"({"count":0,"share":0.0})")) << kind;
}

TEST(JobJson, SaysWhyAJobWaits) {
  JobStatus status = some_job();
  EXPECT_EQ(job_to_json(status)["waiting"], "");
  EXPECT_TRUE(job_to_json(status)["waits_behind"].is_null());
  EXPECT_TRUE(job_to_json(status)["turn_seconds"].is_null());
  status.waiting = "waits behind job j3";
  status.waits_behind = JobId{"j3"};
  status.turn_seconds = 90;
  EXPECT_EQ(job_to_json(status)["waiting"], "waits behind job j3");
  EXPECT_EQ(job_to_json(status)["waits_behind"], "j3");
  EXPECT_EQ(job_to_json(status)["turn_seconds"], 90);
}

TEST(JobJson, HasTheErrorAtSeveralScales) {
  JobStatus status = some_job();
  status.boxes = {BoxError{0.1, 0.05, 0.2, {}}, BoxError{0.3, {}, {}, {}}, BoxError{}};
  const nlohmann::json job = job_to_json(status);
  EXPECT_EQ(job["relmse_4"], 0.1);
  EXPECT_EQ(job["relmse_4_low"], 0.05);
  EXPECT_EQ(job["relmse_4_high"], 0.2);
  EXPECT_EQ(job["relmse_16"], 0.3);
  EXPECT_TRUE(job["relmse_16_low"].is_null());
  EXPECT_TRUE(job["relmse_32"].is_null());
}

TEST(ImageMetadata, HasTheErrorAtSeveralScalesWhereItIsKnown) {
  JobStatus status = some_job();
  status.relmse = 0.2;
  status.boxes[1] = {0.1, 0.05, 0.25, {}};
  const auto metadata = image_metadata(status);
  EXPECT_EQ(metadata.at("relmse"), "0.2");
  EXPECT_EQ(metadata.at("relmse_16"), "0.1");
  EXPECT_EQ(metadata.at("relmse_16_low"), "0.05");
  EXPECT_EQ(metadata.at("relmse_16_high"), "0.25");
  EXPECT_EQ(metadata.count("relmse_4") + metadata.count("relmse_32"), 0u);
}

TEST(JobJson, TilesAndWorkersHaveIdAndState) {
  TileStatus tile;
  tile.id = TileId{3};
  tile.state = "leased";
  EXPECT_EQ(tile_to_json(tile)["id"], 3);
  EXPECT_EQ(tile_to_json(tile)["state"], "leased");
  WorkerStatus worker;
  worker.id = WorkerId{"w1"};
  worker.state = "idle";
  EXPECT_EQ(worker_to_json(worker)["id"], "w1");
  EXPECT_EQ(worker_to_json(worker)["state"], "idle");
}

TEST(JobJson, NamesThatAreNotUtf8DoNoHarm) {
  JobStatus status = some_job();
  status.name = "b\xff";
  EXPECT_NO_THROW(dump(job_to_json(status)));
}

}  // namespace
}  // namespace lightmill::client
