#include "worker/metrics.h"

#include <chrono>

#include "common/base/error.h"
#include "common/rpc/channel.h"

namespace lightmill {
namespace {

using prometheus::BuildCounter;
using prometheus::BuildHistogram;

/// Seconds, from an answer at once to a line that is too slow.
const prometheus::Histogram::BucketBoundaries kSeconds = {0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30};

double since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Counts bytes on their way to another sink.
class CountingSink : public agent::BlobSink {
 public:
  CountingSink(agent::BlobSink& sink, prometheus::Counter& bytes) : sink_(sink), bytes_(bytes) {}
  void begin(const std::string& digest, uint64_t size) override { sink_.begin(digest, size); }
  void write(std::string_view chunk) override {
    sink_.write(chunk);
    bytes_.Increment(static_cast<double>(chunk.size()));
  }
  void end() override { sink_.end(); }

 private:
  agent::BlobSink& sink_;
  prometheus::Counter& bytes_;
};

std::unique_ptr<prometheus::Exposer> listen_on(const std::string& address) {
  const HostPort at = parse_address(address);
  try {
    return std::make_unique<prometheus::Exposer>(at.host + ":" + std::to_string(at.port), 1);
  } catch (const std::exception&) {  // of civetweb; it does not say why
    throw Error(ErrorKind::kFailed, "--http " + address + ": can't listen there; is the port in use?");
  }
}

}  // namespace

prometheus::Counter& WorkerMetrics::counter(const char* name, const char* help,
                                            const prometheus::Labels& labels) {
  return BuildCounter().Name(name).Help(help).Register(*registry_).Add(labels);
}

prometheus::Histogram& WorkerMetrics::seconds(const char* name, const char* help) {
  return BuildHistogram().Name(name).Help(help).Register(*registry_).Add({}, kSeconds);
}

WorkerMetrics::WorkerMetrics(const std::string& address)
    : exposer_(listen_on(address)),
      camera_paths_(
          counter("lightmill_worker_paths_total", "Paths of accepted tiles, by kind.", {{"kind", "camera"}})),
      light_paths_(
          counter("lightmill_worker_paths_total", "Paths of accepted tiles, by kind.", {{"kind", "light"}})),
      closest_hit_rays_(counter("lightmill_worker_rays_total", "Rays of accepted tiles, by kind.",
                                {{"kind", "closest_hit"}})),
      shadow_rays_(
          counter("lightmill_worker_rays_total", "Rays of accepted tiles, by kind.", {{"kind", "shadow"}})),
      cpu_seconds_(counter("lightmill_worker_render_cpu_seconds_total", "CPU time of accepted tiles.")),
      accepted_(counter("lightmill_worker_tiles_total", "Tiles leased, by how they ended.",
                        {{"outcome", "accepted"}})),
      refused_(counter("lightmill_worker_tiles_total", "Tiles leased, by how they ended.",
                       {{"outcome", "refused"}})),
      failed_(counter("lightmill_worker_tiles_total", "Tiles leased, by how they ended.",
                      {{"outcome", "failed"}})),
      handed_back_(counter("lightmill_worker_tiles_total", "Tiles leased, by how they ended.",
                           {{"outcome", "handed_back"}})),
      lost_(
          counter("lightmill_worker_tiles_total", "Tiles leased, by how they ended.", {{"outcome", "lost"}})),
      commit_bytes_(counter("lightmill_worker_commit_bytes_total", "Bytes of partials sent.")),
      scenes_warm_(counter("lightmill_worker_scenes_total", "Scenes of leases, by where they came from.",
                           {{"from", "memory"}})),
      scenes_loaded_(counter("lightmill_worker_scenes_total", "Scenes of leases, by where they came from.",
                             {{"from", "files"}})),
      blob_bytes_(counter("lightmill_worker_blob_bytes_fetched_total", "Bytes of scene files fetched.")),
      bytes_wanted_(counter("lightmill_worker_blob_bytes_wanted_total",
                            "Bytes of scene files needed; what was not fetched was in the cache.")),
      lease_wait_(seconds("lightmill_worker_lease_wait_seconds", "From asking for a tile to its lease.")),
      commit_seconds_(seconds("lightmill_worker_commit_seconds", "From sending a partial to the answer.")) {
  exposer_->RegisterCollectable(registry_);
}

int WorkerMetrics::port() const { return exposer_->GetListeningPorts().at(0); }

void WorkerMetrics::accepted(const RenderCounters& counters, double cpu_seconds) {
  camera_paths_.Increment(static_cast<double>(counters.camera_paths));
  light_paths_.Increment(static_cast<double>(counters.light_paths));
  closest_hit_rays_.Increment(static_cast<double>(counters.closest_hit_rays));
  shadow_rays_.Increment(static_cast<double>(counters.shadow_rays));
  cpu_seconds_.Increment(cpu_seconds);
}

std::optional<LeaseGrant> MeasuredLink::lease(double wait_seconds) {
  const auto begin = std::chrono::steady_clock::now();
  std::optional<LeaseGrant> grant = link_.lease(wait_seconds);
  if (grant) metrics_.lease_wait_.Observe(since(begin));
  return grant;
}

std::vector<LeaseKey> MeasuredLink::renew(const std::vector<LeaseKey>& held) {
  std::vector<LeaseKey> lost = link_.renew(held);
  metrics_.lost_.Increment(static_cast<double>(lost.size()));
  return lost;
}

agent::CommitAnswer MeasuredLink::commit(const LeaseKey& key, const std::string& partial_bytes) {
  const auto begin = std::chrono::steady_clock::now();
  agent::CommitAnswer answer = link_.commit(key, partial_bytes);
  metrics_.commit_seconds_.Observe(since(begin));
  metrics_.commit_bytes_.Increment(static_cast<double>(partial_bytes.size()));
  const bool in =
      answer.outcome == CommitResult::kAccepted || answer.outcome == CommitResult::kAlreadyCommitted;
  (in ? metrics_.accepted_ : metrics_.refused_).Increment();
  return answer;
}

void MeasuredLink::fail(const LeaseKey& key, const std::string& reason, FailureKind kind) {
  link_.fail(key, reason, kind);
  metrics_.failed_.Increment();
}

void MeasuredLink::hand_back(const LeaseKey& key, agent::HandBack why) {
  link_.hand_back(key, why);
  metrics_.handed_back_.Increment();
}

Bundle MeasuredLink::bundle(const std::string& digest) {
  Bundle bundle = link_.bundle(digest);
  metrics_.scenes_loaded_.Increment();
  for (const BundleEntry& entry : bundle.entries)
    metrics_.bytes_wanted_.Increment(static_cast<double>(entry.size));
  return bundle;
}

void MeasuredLink::fetch_blobs(const std::vector<std::string>& digests, agent::BlobSink& sink) {
  CountingSink counting(sink, metrics_.blob_bytes_);
  link_.fetch_blobs(digests, counting);
}

std::shared_ptr<const agent::PacketRenderer> MeasuredSource::open(const std::string& bundle_digest,
                                                                  const RenderSettings& settings,
                                                                  const agent::LookWanted* look) {
  const double loaded = metrics_.scenes_loaded_.Value();
  auto renderer = source_.open(bundle_digest, settings, look);
  if (metrics_.scenes_loaded_.Value() == loaded) metrics_.scenes_warm_.Increment();
  return renderer;
}

}  // namespace lightmill
