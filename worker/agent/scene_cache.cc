#include "worker/agent/scene_cache.h"

#include <algorithm>

#include "common/error.h"
#include "common/scene/load.h"

namespace lightmill::agent {
namespace {

/// Scenes kept besides those that leases hold: enough for a few jobs that take turns.
constexpr size_t kWarmScenes = 3;
/// Renderers kept per scene: they share it and are small.
constexpr size_t kWarmRenderers = 8;

/// What a packet's bits depend on: the scene and the settings without the stop rule, so that an extended job
/// finds its renderer again.
std::string warm_key(const std::string& bundle_digest, RenderSettings settings) {
  settings.spp = 1;
  settings.time_s = 0;
  settings.target_error = 0;
  return bundle_digest + " " + settings_to_json(settings);
}

/// What a built scene depends on: the same without how it is sampled.
std::string scene_key(const std::string& bundle_digest, RenderSettings settings) {
  settings.integrator = Integrator::kAuto;
  settings.plan.reset();
  settings.max_depth = 0;
  settings.seed = 0;
  return warm_key(bundle_digest, settings);
}

template <class List, class Matches>
bool move_to_front(List& list, Matches matches) {
  const auto found = std::find_if(list.begin(), list.end(), matches);
  if (found != list.end()) list.splice(list.begin(), list, found);
  return found != list.end();
}

SceneDescription load(const Bundle& bundle, const std::string& folder) {
  LoadResult result =
      load_scene(bundle.main, BundleFiles(bundle, folder), {false, bundle.camera, bundle.environment});
  if (result.ok()) return std::move(result.scene);
  const auto first = std::find_if(result.problems.begin(), result.problems.end(), [](const Problem& problem) {
    return problem.severity == Severity::kError;
  });
  throw Error(ErrorKind::kBadScene,
              first == result.problems.end() ? bundle.main + ": cannot be read" : format_problem(*first));
}

}  // namespace

SceneCache::SceneCache(FarmLink& link, std::string folder, uint64_t max_bytes, int threads)
    : link_(link), blobs_(std::move(folder), max_bytes), threads_(threads) {}

std::shared_ptr<const PacketRenderer> SceneCache::open(const std::string& bundle_digest,
                                                       const RenderSettings& settings) {
  const std::string key = warm_key(bundle_digest, settings), scene = scene_key(bundle_digest, settings);
  if (!move_to_front(warm_, [&](const Warm& warm) { return warm.scene_key == scene; })) {
    const Bundle bundle = link_.bundle(bundle_digest);
    if (bundle.digest() != bundle_digest) {
      throw Damaged("bundle " + bundle_digest + ": the manifest does not match its digest");
    }
    blobs_.ensure(bundle, link_);
    if (warm_.size() >= kWarmScenes) warm_.pop_back();  // before building: two large scenes may not fit
    auto renderer = make_packet_renderer(load(bundle, blobs_.folder()), settings, threads_);
    warm_.push_front({scene, {{key, std::move(renderer)}}});
  }
  std::list<Ready>& ready = warm_.front().renderers;
  if (!move_to_front(ready, [&](const Ready& r) { return r.key == key; })) {
    ready.push_front({key, ready.front().renderer->with_settings(settings)});
    if (ready.size() > kWarmRenderers) ready.pop_back();
  }
  return ready.front().renderer;
}

}  // namespace lightmill::agent
