#pragma once
// The worker's life: register, lease, render on N threads, commit, renew, drain.
//
//   TileRunner runner(link, source, {.threads = 8, .registration = ...});
//   std::thread control([&] { wait_for_sigterm(); runner.drain(); });
//   runner.run();
//
// Threads: the caller of run() leases and opens scenes; N threads render packets of up to a few leases at
// once, so that none idles at the end of a tile; one encodes and commits; one runs pilots, on N threads of
// their own; one renews at a third of the lease time; one hands in lost scene files. None of them waits for
// another's RPC.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include "worker/agent/farm_link.h"
#include "worker/agent/lease_queue.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::agent {

struct RunnerOptions {
  int threads = 1;
  WorkerRegistration registration;
  double lease_wait_seconds = 5;  // long poll
  double drain_timeout_seconds = 60;
  double idle_timeout_seconds = 0;  // drain after so long without a tile, or without a coordinator; 0: never
  std::function<void(const std::string&)> log = [](const std::string&) {};    // any thread; one line
  std::function<void(const std::string&)> debug = [](const std::string&) {};  // a line per tile
  /// What a tile that was accepted had cost; the commit thread.
  std::function<void(const RenderCounters&, double cpu_seconds)> accepted = [](const RenderCounters&,
                                                                               double) {};
};

class TileRunner {
 public:
  /// `link` and `source` must outlive the runner.
  TileRunner(FarmLink& link, RenderSource& source, RunnerOptions options);
  /// Until drained or stopped. Throws Error if the coordinator refuses this worker for good.
  void run();
  /// Takes no more leases, finishes the tiles held within the drain timeout, then run() returns. A pilot is
  /// handed back at once, and so are tiles that take longer. Any thread.
  void drain();
  /// Drops everything; run() returns soon. Any thread, also before run().
  void stop();
  int64_t tiles_committed() const { return tiles_committed_; }

 private:
  void lease_loop();
  void open_lease(const LeaseGrant& lease);
  void render_loop();
  void commit_loop();
  void pilot_loop();
  void run_pilot(const PilotLease& pilot);
  void take_first_look(const PilotLease& pilot, const std::function<bool()>& go_on);
  void show(const LeaseGrant& lease, const Image& picture);
  void hand_back(const LeaseKey& key, HandBack why);
  /// Hands in a lease's result, or its failure; true if it was accepted.
  bool hand_in(const LeaseKey& key, const std::string& bytes);
  /// Throws what the farm answers.
  void report_failure(const LeaseKey& key, const TileFailure& failure);
  /// The same, but logs what it answers.
  void give_up(const LeaseKey& key, const TileFailure& failure);
  void commit_one(const LeaseQueue::Finished& finished);
  void renew_loop();
  void give_loop();
  void finish_held();
  template <class F>
  bool retry(const std::function<bool()>& wanted, F call);
  bool register_again(uint64_t seen);
  bool sleep(
      double seconds, const std::function<bool()>& wanted = [] { return true; });
  bool is_stopping() const { return stopping_.load(); }

  FarmLink& link_;
  RenderSource& source_;
  const RunnerOptions options_;
  LeaseQueue queue_;
  /// The last job whose missing light the farm was told of, and under which registration: what a coordinator
  /// has forgotten is told again. For the leasing thread only.
  std::pair<JobId, uint64_t> warned_;
  std::mutex mutex_;
  std::condition_variable woken_;
  std::atomic<bool> stopping_{false}, draining_{false};
  std::atomic<uint64_t> generation_{0};  // counts registrations
  std::mutex register_mutex_;
  std::atomic<double> lease_seconds_{10};
  std::atomic<int64_t> tiles_committed_{0};
  std::mutex refusal_mutex_;
  std::exception_ptr refusal_;
};

}  // namespace lightmill::agent
