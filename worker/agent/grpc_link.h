#pragma once
// The farm link over gRPC. Dials out; every call has a deadline.
#include <memory>
#include <string>

#include "common/rpc/security.h"
#include "worker/agent/farm_link.h"

namespace lightmill::agent {

class GrpcLink : public FarmLink {
 public:
  /// Does not connect yet. `addresses`: of one coordinator or several (common/rpc/coordinators.h). With
  /// `security` (resolved) TLS and a token; else plain text: throws Error(kUsage) unless the address is
  /// loopback or `insecure` allows it.
  GrpcLink(const std::string& addresses, bool insecure, const SecurityFiles& security = {});
  ~GrpcLink() override;
  void register_worker(const WorkerRegistration& registration) override;
  std::optional<LeaseGrant> lease(double wait_seconds) override;
  std::vector<LeaseKey> renew(const std::vector<LeaseKey>& held) override;
  CommitAnswer commit(const LeaseKey& key, const std::string& partial_bytes) override;
  void fail(const LeaseKey& key, const std::string& reason, FailureKind kind) override;
  void warn(const LeaseKey& key, const std::vector<std::string>& missing_light) override;
  void show(const LeaseKey& key, const Image& picture) override;
  void hand_back(const LeaseKey& key, HandBack why) override;
  void drain() override;
  Bundle bundle(const std::string& digest) override;
  void fetch_blobs(const std::vector<std::string>& digests, BlobSink& sink) override;
  std::vector<std::string> take_wanted_blobs() override;
  bool hand_in_blob(const std::string& digest, const std::string& path) override;
  void cancel() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill::agent
