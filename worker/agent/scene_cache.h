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
  /// Renderers build with `threads` threads; the last few stay warm, whatever their jobs' spp.
  SceneCache(FarmLink& link, std::string folder, uint64_t max_bytes, int threads);
  std::shared_ptr<const PacketRenderer> open(const std::string& bundle_digest,
                                             const RenderSettings& settings) override;

 private:
  struct Warm {
    std::string key;
    std::shared_ptr<const PacketRenderer> renderer;
  };
  FarmLink& link_;
  BlobCache blobs_;
  int threads_;
  std::list<Warm> warm_;  // most recently used first
};

}  // namespace lightmill::agent
