#pragma once
// The leases that a worker holds, from grant to commit, and the packets that its threads pull from them.
//
// A lease is *loading* (its scene is being opened), *rendering* (packets are handed out, oldest lease first),
// *finished* (waits for the commit thread) and then gone. A lease that the coordinator has taken away is
// *lost*: its packets are no longer handed out and its partial is thrown away.
//
// A lease of a job's pilot goes from the leasing thread to the pilot thread instead, one at a time; while it
// is there nothing more is leased, as the pilot wants all threads.
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/film/partial.h"
#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"
#include "worker/agent/tile_failure.h"

namespace lightmill::agent {

/// The packets of a tile: its cells times the sample blocks that it touches, cut to its range.
class PacketList {
 public:
  explicit PacketList(const TileSpec& tile);
  int64_t size() const { return cells_ * blocks_; }
  Packet operator[](int64_t index) const;

 private:
  TileSpec tile_;
  int64_t cells_, first_block_, blocks_;
};

/// A lease whose renderer is ready.
struct ActiveLease {
  ActiveLease(LeaseGrant granted, std::shared_ptr<const PacketRenderer> ready);
  const LeaseGrant lease;
  const std::shared_ptr<const PacketRenderer> renderer;
  PartialBuilder builder;  // thread-safe by itself

 private:
  friend class LeaseQueue;
  const PacketList packets_;
  // Guarded by the queue's mutex.
  int64_t next_ = 0;        // first packet that was not handed out
  int64_t unfinished_ = 0;  // handed out, still being rendered
  bool lost_ = false;
  TileFailure failure_;  // of a packet
};

/// A pilot that waits to be run.
struct PilotLease {
  LeaseGrant lease;
  std::shared_ptr<const PacketRenderer> renderer;
  bool shown = false;  // there was a first look already
};

/// Thread-safe.
class LeaseQueue {
 public:
  explicit LeaseQueue(int threads) : threads_(threads) {}

  // --- the thread that leases ---
  /// Blocks until another lease is worth asking for (true), or the queue was closed or told to stop growing.
  /// It is once what is left of those at hand takes less than the lead: later, a thread would idle; sooner,
  /// a tile would wait here that an idle worker could render.
  bool wait_for_room();
  /// Seconds from asking for a lease until its packets can be handed out.
  void set_lead(double seconds);
  /// A lease was granted; it is renewed from now on.
  void hold(const LeaseKey& key);
  void start(std::shared_ptr<ActiveLease> lease);
  void start_pilot(PilotLease pilot);
  /// It will not be rendered after all.
  void release(const LeaseKey& key);

  // --- render threads ---
  struct Work {
    std::shared_ptr<ActiveLease> lease;
    Packet packet;
    std::chrono::steady_clock::time_point begun = {};
  };
  /// The next packet; blocks. Empty once the queue is closed.
  std::optional<Work> take();
  /// The packet is done, or has failed.
  void finish(const Work& work, const TileFailure& failure = {});

  // --- the pilot thread ---
  /// The next pilot; blocks. Empty once the queue is closed. release() ends it.
  std::optional<PilotLease> take_pilot();

  // --- the thread that commits ---
  struct Finished {
    std::shared_ptr<ActiveLease> lease;
    TileFailure failure;  // if the tile failed: report it instead
  };
  /// The next lease all of whose packets are done; blocks. Empty once the queue is closed.
  std::optional<Finished> take_finished();

  // --- renewal and shutdown ---
  std::vector<LeaseKey> held() const;
  bool is_held(const LeaseKey& key) const;
  void lose(const std::vector<LeaseKey>& keys);
  /// No more leases: wait_for_room returns false.
  void stop_growing();
  /// Blocks until nothing is held, at most `seconds`; true if so.
  bool wait_until_empty(double seconds) const;
  /// Wakes everyone; take and take_finished return empty.
  void close();

 private:
  bool has_room() const;
  void measure(const Work& work);
  void retire(const std::shared_ptr<ActiveLease>& lease);

  const int threads_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::set<LeaseKey> held_;
  std::deque<std::shared_ptr<ActiveLease>> rendering_;  // not all packets are done, oldest first
  std::deque<Finished> finished_;
  std::optional<PilotLease> pilot_;        // not taken yet
  std::optional<LeaseKey> pilot_running_;  // taken, and not released yet
  bool growing_ = true, closed_ = false;
  double lead_ = 0;
  double sample_seconds_ = -1;  // of a thread, per cell and sample index, lately; negative: not known yet
};

}  // namespace lightmill::agent
