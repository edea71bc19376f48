#pragma once
// What a worker tells Prometheus, on request (--http): what it leases, renders, sends and finds in its cache.
//
//   WorkerMetrics metrics("127.0.0.1:9100");     // listens; before the sandbox is entered
//   MeasuredLink link(grpc_link, metrics);        // in place of the link
//   MeasuredSource scenes(scene_cache, metrics);  // in place of the scene cache
#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <memory>
#include <string>

#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill {

class WorkerMetrics {
 public:
  /// Serves http://ADDRESS/metrics from threads of its own, as plain text to whoever reaches it. Throws
  /// Error(kUsage) for a malformed address, Error(kFailed) if it can't be bound.
  explicit WorkerMetrics(const std::string& address);
  int port() const;
  /// Packets of a tile were rendered and accepted.
  void accepted(const RenderCounters& counters, double cpu_seconds);

 private:
  friend class MeasuredLink;
  friend class MeasuredSource;
  prometheus::Counter& counter(const char* name, const char* help, const prometheus::Labels& labels = {});
  prometheus::Histogram& seconds(const char* name, const char* help);

  const std::shared_ptr<prometheus::Registry> registry_ = std::make_shared<prometheus::Registry>();
  std::unique_ptr<prometheus::Exposer> exposer_;
  prometheus::Counter &camera_paths_, &light_paths_, &closest_hit_rays_, &shadow_rays_, &cpu_seconds_;
  prometheus::Counter &accepted_, &refused_, &failed_, &handed_back_, &lost_, &commit_bytes_;
  prometheus::Counter &scenes_warm_, &scenes_loaded_, &blob_bytes_, &bytes_wanted_;
  prometheus::Histogram &lease_wait_, &commit_seconds_;
};

/// Passes all on, and measures it.
class MeasuredLink : public agent::FarmLink {
 public:
  /// Both must outlive this object.
  MeasuredLink(agent::FarmLink& link, WorkerMetrics& metrics) : link_(link), metrics_(metrics) {}
  void register_worker(const WorkerRegistration& registration) override {
    link_.register_worker(registration);
  }
  std::optional<LeaseGrant> lease(double wait_seconds) override;
  std::vector<LeaseKey> renew(const std::vector<LeaseKey>& held) override;
  agent::CommitAnswer commit(const LeaseKey& key, const std::string& partial_bytes) override;
  void fail(const LeaseKey& key, const std::string& reason, FailureKind kind) override;
  void show(const LeaseKey& key, const Image& picture) override { link_.show(key, picture); }
  void warn(const LeaseKey& key, const std::vector<std::string>& missing_light) override {
    link_.warn(key, missing_light);
  }
  void hand_back(const LeaseKey& key, agent::HandBack why) override;
  void drain() override { link_.drain(); }
  Bundle bundle(const std::string& digest) override;
  void fetch_blobs(const std::vector<std::string>& digests, agent::BlobSink& sink) override;
  std::vector<std::string> take_wanted_blobs() override { return link_.take_wanted_blobs(); }
  bool hand_in_blob(const std::string& digest, const std::string& path) override {
    return link_.hand_in_blob(digest, path);
  }
  void cancel() override { link_.cancel(); }

 private:
  agent::FarmLink& link_;
  WorkerMetrics& metrics_;
};

/// Counts the scenes that were there already, and those that had to be loaded: they ask for their bundle.
class MeasuredSource : public agent::RenderSource {
 public:
  MeasuredSource(agent::RenderSource& source, WorkerMetrics& metrics) : source_(source), metrics_(metrics) {}
  std::shared_ptr<const agent::PacketRenderer> open(const std::string& bundle_digest,
                                                    const RenderSettings& settings,
                                                    const agent::LookWanted* look) override;
  std::string find_blob(const std::string& digest) const override { return source_.find_blob(digest); }

 private:
  agent::RenderSource& source_;
  WorkerMetrics& metrics_;
};

}  // namespace lightmill
