#pragma once
// Renderers of the scenes that this worker's leases name: blobs from the coordinator, scenes from blobs.
#include <list>
#include <memory>
#include <string>

#include "worker/agent/blob_cache.h"
#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::agent {

class SceneCache : public RenderSource {
 public:
  /// Scenes are built with `threads` threads; the last few stay warm, whatever their jobs' stop rules, and
  /// are shared by jobs that differ in their sampling only (plan, integrator, depth, seed).
  SceneCache(FarmLink& link, std::string folder, uint64_t max_bytes, int threads);
  std::shared_ptr<const PacketRenderer> open(const std::string& bundle_digest,
                                             const RenderSettings& settings) override;

 private:
  struct Ready {
    std::string key;
    std::shared_ptr<const PacketRenderer> renderer;
  };
  struct Warm {
    std::string scene_key;
    std::list<Ready> renderers;  // of one scene, most recently used first
  };
  FarmLink& link_;
  BlobCache blobs_;
  int threads_;
  std::list<Warm> warm_;  // most recently used first
};

}  // namespace lightmill::agent
