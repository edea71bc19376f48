#include "client/json_output.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
