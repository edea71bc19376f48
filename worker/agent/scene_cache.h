#pragma once
// Renderers of the scenes that this worker's leases name: blobs from the coordinator, scenes from blobs.
#include <atomic>
#include <list>
#include <memory>
#include <string>

#include "worker/agent/blob_cache.h"
#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::agent {

struct SceneCacheOptions {
  std::string folder;        // of blobs
  uint64_t blob_bytes = 0;   // of files in it
  uint64_t scene_bytes = 0;  // of memory of warm scenes
  BuildOptions build;        // of each scene
};

class SceneCache : public RenderSource {
 public:
  /// Scenes that were used last stay warm, as many as fit into `options.scene_bytes`, whatever their jobs'
  /// stop rules; they are shared by jobs that differ in their sampling only (plan, integrator, depth, seed).
  /// The last one and those that leases hold stay even if they do not fit.
  SceneCache(FarmLink& link, SceneCacheOptions options);
  std::shared_ptr<const PacketRenderer> open(const std::string& bundle_digest, const RenderSettings& settings,
                                             const LookWanted* look) override;
  std::string find_blob(const std::string& digest) const override { return blobs_.find(digest); }
  /// Scenes that were read and built so far.
  int64_t scenes_built() const { return scenes_built_; }
  /// Memory of the scenes that are warm.
  uint64_t warm_bytes() const;

 private:
  struct Ready {
    std::string key;
    std::shared_ptr<const PacketRenderer> renderer;
  };
  struct Warm {
    std::string scene_key;
    uint64_t bytes = 0;
    std::list<Ready> renderers;  // of one scene, most recently used first
    bool is_held() const;        // by a lease
  };
  /// Lets go of those used longest ago until `more` bytes fit beside the rest.
  void make_room(uint64_t more, size_t keep);

  FarmLink& link_;
  const SceneCacheOptions options_;
  BlobCache blobs_;
  std::list<Warm> warm_;  // most recently used first
  std::atomic<int64_t> scenes_built_{0};
};

}  // namespace lightmill::agent
