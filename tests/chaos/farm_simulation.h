#pragma once
// A farm under chaos in simulated time: workers that die, stop and fall asleep, messages that are lost, late,
// repeated and damaged, a coordinator that crashes, a disk that fails, a clock that jumps; all drawn from one
// seed. What it asks of the farm is checked on the way and thrown as std::runtime_error.
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill::testing {

/// What a simulation did, so that a test can ask whether it did anything.
struct ChaosCounts {
  int crashes = 0, storage_faults = 0, clock_jumps = 0, deaths = 0, pauses = 0;
  int lost = 0, late = 0, repeated = 0, damaged = 0;
  int re_leased_after_death = 0;
  uint64_t checks = 0;
  int races = 0;                     // tiles that two workers had at the same time
  double longest_wait_for_dead = 0;  // seconds from a worker's death to the end of its last lease
  double seconds = 0;                // simulated
};

class FarmSimulation {
 public:
  /// `spot_check` as in FarmOptions.
  FarmSimulation(uint64_t seed, const JobRequest& request, int spot_check = 0);
  ~FarmSimulation();
  /// Until the job is done; then everything is compared. Throws std::runtime_error with what is wrong.
  ChaosCounts run();

 private:
  struct Worker {
    WorkerId id;  // empty: not registered
    bool alive = true;
    double stopped_until = 0;
    struct Held {
      LeaseGrant grant;
      double done_at = 0;
      double sent_at = -1;  // of the last commit; negative: none
    };
    std::map<LeaseKey, Held> held;
    double next_renewal = 0;
    double speed = 1;  // tile times are divided by it
  };
  struct Message {
    double at = 0;
    std::function<void()> deliver;
  };

  void step();
  void bring_chaos();
  void crash_coordinator();
  void act(Worker& worker);
  void lease(Worker& worker);
  void send_commit(Worker& worker, const LeaseKey& key);
  void deliver_commit(size_t worker, const WorkerId& id, const LeaseKey& key, const std::string& bytes,
                      bool answered);
  void check_dead_leases();
  void check_acknowledged();
  void check_end();
  double draw(double low, double high) { return std::uniform_real_distribution<>(low, high)(random_); }
  bool chance(double probability) { return draw(0, 1) < probability; }
  [[noreturn]] void fail(const std::string& what) const;

  const uint64_t seed_;
  std::mt19937_64 random_;
  JobRequest request_;
  FarmOptions options_;
  FakeClock clock_;
  MemoryJobStore store_;
  std::unique_ptr<Farm> farm_;
  JobId job_;
  std::vector<Worker> workers_;
  std::vector<Message> messages_;
  std::set<LeaseKey> acknowledged_;
  std::set<LeaseKey> checks_;              // leases of committed tiles: nothing of them goes into the ledger
  std::map<WorkerId, double> dead_since_;  // by the simulation's own time
  double quiet_until_ = 0;  // leases of the dead may last longer after a fault of disk or clock
  double now_ = 0;          // the world's time; the farm's clock may have jumped
  double storage_broken_until_ = -1;
  ChaosCounts counts_;
};

}  // namespace lightmill::testing
