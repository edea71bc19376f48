#include "worker/agent/scene_cache.h"

#include <algorithm>

#include "common/base/error.h"
#include "common/scene/load.h"
#include "worker/render/plan/first_look.h"

namespace lightmill::agent {
namespace {

/// Renderers kept per scene: they share it and are small.
constexpr size_t kWarmRenderers = 8;

enum class Key { kPacket, kScene };

/// What a packet's bits depend on: the scene and the settings without the stop rule, so that an extended job
/// finds its renderer again. What a built scene depends on: the same without how it is sampled; but for path
/// tracing alone, which has no use for what lights learn of their paths.
std::string key_of(Key key, const std::string& bundle_digest, RenderSettings settings) {
  settings.spp = 1;
  settings.time_s = 0;
  settings.target_error = 0;
  settings.target_denoised = false;
  if (key == Key::kScene) {
    if (settings.integrator != Integrator::kPt) settings.integrator = Integrator::kAuto;
    settings.plan.reset();
    settings.max_depth = 0;
    settings.seed = 0;
  }
  return bundle_digest + " " + settings_to_json(settings);
}

template <class List, class Matches>
bool move_to_front(List& list, Matches matches) {
  const auto found = std::find_if(list.begin(), list.end(), matches);
  if (found != list.end()) list.splice(list.begin(), list, found);
  return found != list.end();
}

SceneDescription load(const Bundle& bundle, const std::string& folder, int threads) {
  LoadOptions options = load_options(bundle);
  options.threads = threads;
  LoadResult result = load_scene(bundle.main, BundleFiles(bundle, folder), options);
  if (result.ok()) return std::move(result.scene);
  const auto first = std::find_if(result.problems.begin(), result.problems.end(), [](const Problem& problem) {
    return problem.severity == Severity::kError;
  });
  throw Error(ErrorKind::kBadScene,
              first == result.problems.end() ? bundle.main + ": cannot be read" : format_problem(*first));
}

}  // namespace

SceneCache::SceneCache(FarmLink& link, SceneCacheOptions options)
    : link_(link), options_(std::move(options)), blobs_(options_.folder, options_.blob_bytes) {}

bool SceneCache::Warm::is_held() const {
  return std::any_of(renderers.begin(), renderers.end(),
                     [](const Ready& ready) { return ready.renderer.use_count() > 1; });
}

uint64_t SceneCache::warm_bytes() const {
  uint64_t sum = 0;
  for (const Warm& warm : warm_) sum += warm.bytes;
  return sum;
}

void SceneCache::make_room(uint64_t more, size_t keep) {
  uint64_t bytes = warm_bytes() + more;
  for (auto warm = warm_.end(); bytes > options_.scene_bytes && warm != std::next(warm_.begin(), keep);) {
    --warm;
    if (warm->is_held()) continue;
    bytes -= warm->bytes;
    warm = warm_.erase(warm);
  }
}

std::shared_ptr<const PacketRenderer> SceneCache::open(const std::string& bundle_digest,
                                                       const RenderSettings& settings,
                                                       const LookWanted* look) {
  const std::string key = key_of(Key::kPacket, bundle_digest, settings),
                    scene = key_of(Key::kScene, bundle_digest, settings);
  if (!move_to_front(warm_, [&](const Warm& warm) { return warm.scene_key == scene; })) {
    const Bundle bundle = link_.bundle(bundle_digest);
    if (bundle.digest() != bundle_digest) {
      throw Damaged("bundle " + bundle_digest + ": the manifest does not match its digest");
    }
    blobs_.ensure(bundle, link_);
    // Before it is built: two large scenes may not fit. A scene takes about what its files do, or more.
    uint64_t files = 0;
    for (const BundleEntry& entry : bundle.entries) files += entry.size;
    make_room(files, 0);
    BuildOptions build = options_.build;
    if (look) {
      build.when_built = [&](const Renderer& scene) {
        try {
          const Image picture = first_look(scene, build.threads, look->go_on);
          if (!picture.data.empty()) look->show(picture);
        } catch (const Error&) {
          // Nobody wants it any more, or the render itself will say what is wrong.
        }
      };
    }
    auto renderer = make_packet_renderer(load(bundle, blobs_.folder(), build.threads), settings, build);
    ++scenes_built_;
    const uint64_t bytes = renderer->memory_bytes();
    warm_.push_front({scene, bytes, {{key, std::move(renderer)}}});
  }
  make_room(0, 1);
  std::list<Ready>& ready = warm_.front().renderers;
  if (!move_to_front(ready, [&](const Ready& r) { return r.key == key; })) {
    ready.push_front({key, ready.front().renderer->with_settings(settings)});
    if (ready.size() > kWarmRenderers) ready.pop_back();
  }
  return ready.front().renderer;
}

}  // namespace lightmill::agent
