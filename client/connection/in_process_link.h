#pragma once
// The farm link of `lightmill render`: calls the embedded coordinator core, so that local renders go through
// the same leases and the same merge as distributed ones.
#include <atomic>

#include "coordinator/core/farm.h"
#include "worker/agent/farm_link.h"

namespace lightmill::client {

class InProcessLink : public agent::FarmLink {
 public:
  /// `farm` must outlive the link.
  explicit InProcessLink(Farm& farm) : farm_(farm) {}
  void register_worker(const WorkerRegistration& registration) override;
  std::optional<LeaseGrant> lease(double wait_seconds) override;
  std::vector<LeaseKey> renew(const std::vector<LeaseKey>& held) override;
  agent::CommitAnswer commit(const LeaseKey& key, const std::string& partial_bytes) override;
  void fail(const LeaseKey& key, const std::string& reason, FailureKind kind) override;
  void warn(const LeaseKey& key, const std::vector<std::string>& missing_light) override;
  void show(const LeaseKey& key, const Image& picture) override;
  void hand_back(const LeaseKey& key, agent::HandBack why) override;
  void drain() override;
  Bundle bundle(const std::string& digest) override;
  /// The scene is in this process already; never called.
  void fetch_blobs(const std::vector<std::string>& digests, agent::BlobSink& sink) override;
  void cancel() override { cancelled_ = true; }

 private:
  void throw_if_cancelled() const;
  Farm& farm_;
  WorkerId worker_;  // set once, before any other call
  std::atomic<bool> cancelled_{false};
};

}  // namespace lightmill::client
