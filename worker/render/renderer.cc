#include "worker/render/renderer.h"

#include <malloc.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/base/error.h"
#include "common/scene/load.h"
#include "common/scene/parts_in_use.h"
#include "common/scene/possible_strategies.h"
#include "worker/render/guiding/training/emission_guide_training.h"
#include "worker/render/guiding/training/manifold_training.h"
#include "worker/render/guiding/training/missing_light.h"
#include "worker/render/guiding/training/next_event_guide_training.h"
#include "worker/render/guiding/training/photon_guide_training.h"
#include "worker/render/pipeline/pipeline.h"
#include "worker/render/pipeline/recording/aov_recorder.h"
#include "worker/render/plan/analysis/light_media.h"
#include "worker/render/plan/analysis/radiance_scale.h"
#include "worker/render/plan/analysis/scene_analysis.h"
#include "worker/render/plan/analysis/stage_kernels.h"
#include "worker/render/plan/plan_set.h"

namespace lightmill {
namespace {

class WavefrontWorkspace : public Workspace {
 public:
  std::unique_ptr<Wavefront> wavefront = std::make_unique<Wavefront>();

  /// Hangs a recorder of these AOVs on the wavefront; none if there are none.
  void record_aovs(const AovSpec& spec) {
    if (spec.set && (!aovs || !(aovs->spec() == spec))) aovs = std::make_unique<AovRecorder>(spec);
    wavefront->aovs = spec.set ? aovs.get() : nullptr;
    wavefront->groups = spec.set ? aovs->groups().light() : nullptr;
    wavefront->lobes = spec.set ? aovs->lobes().light() : nullptr;
  }

 private:
  std::unique_ptr<AovRecorder> aovs;
};

/// Denormals cost a hundred cycles each and carry nothing here: flush them on this thread,
/// restore on leaving.
class FlushDenormals {
 public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }
  ~FlushDenormals() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
};

/// Materials that nothing shows become plain ones: some need tables that take long to make.
void drop_unused_materials(SceneDescription* description) {
  const PartsInUse parts = parts_in_use(*description);
  for (size_t i = 0; i < description->materials.size(); ++i) {
    if (!parts.materials[i]) description->materials[i] = {};
  }
}

/// Frees what only the description holds, so that it does not add to the peak of building the tree.
void drop_geometry(SceneDescription* description) {
  description->shapes = {};
  description->objects = {};
  description->instances = {};
  for (MediumDescription& medium : description->media) medium.grid = nullptr;
  malloc_trim(0);  // large arrays, which the allocator would keep
}

/// Of the paths by which others learn where to go: how far they are followed, and their random numbers, which
/// are not those of the image.
constexpr int kLearntDepth = 8;
constexpr uint64_t kLearningSeed = 0x61696d73;
/// Of the paths that show how bright the image is; not the job's, as jobs of other depths share the scene.
constexpr int kSeenDepth = 64;

/// What runs under the settings; before its pilot, all that the scene allows. Throws Error(kUsage) if it does
/// not allow what the settings ask for.
Strategies running(const RenderSettings& s, const PossibleStrategies& possible) {
  const Strategies wanted = strategies_of(s);
  if (wanted & ~possible.set && !needs_pilot(s))
    throw Error(ErrorKind::kUsage, strategy_names(wanted & ~possible.set) + ": " + possible.why_no_more +
                                       "; use the integrator auto, or a plan without");
  return wanted & possible.set;
}

/// What the scene is built with although nothing of it may need that.
Features features_built(const RenderSettings& s) {
  return s.overrides | (s.aovs & kAovUv ? kTextureCoordinates : 0);
}

}  // namespace

/// What does not depend on the sampling.
struct Renderer::World {
  PossibleStrategies possible;
  RenderScene scene;
  Accel accel;
  Camera camera;
  PixelFilter filter;
  double imaging_ratio;
  FilmResponse response;
  MissingLight missing;
  RadianceScale radiance;
  std::optional<SourceLocation> first_medium;

  World(SceneDescription description, const RenderSettings& s, const BuildOptions& options)
      : possible(possible_strategies(description)),
        scene((options.unused_textures ? void() : drop_unused_materials(&description),
               build_scene(description, s.energy_compensation, features_built(s), options))),
        accel((drop_geometry(&description), scene), options.threads),
        camera(make_camera(description.camera, s.grid.width, s.grid.height, scene.scale_exponent)),
        filter(description.filter),
        imaging_ratio(description.film.imaging_ratio),
        response(description.film) {
    if (!description.media.empty()) first_medium = description.media.front().location;
    radiance = radiance_scale(scene, imaging_ratio, {});  // as long as nothing was seen
  }

  /// Trains guides, and finds what else the scene's own paths tell. Once, before renderers share this.
  void learn(const RenderSettings& s, int threads) {
    const FlushDenormals flush;
    train_next_event_guide(accel, camera, filter, s.grid.width, s.grid.height, threads, &scene);
    if (first_medium)
      find_light_media(accel, camera, filter, s.grid.width, s.grid.height, *first_medium, &scene);
    learn_paths(s, threads);
    find_radiance_scale(s);
  }

  /// What the stages read, under these settings.
  StageContext context_of(const RenderSettings& s, Strategies strategies) const {
    StageContext context = learning_context(s, strategies);
    context.light_factor = std::ldexp(1.0f, scene.light_exponent);
    return context;
  }
  /// The same for what learns or chooses: light stays normalised.
  StageContext learning_context(const RenderSettings& s, Strategies strategies) const {
    const SamplingPlan sampling = plan_of(s);
    StageContext context{scene,  accel,  camera,
                         filter, s.grid, scene.lights_of(uses_emission_guide(scene, sampling, strategies))};
    context.seed = s.seed;
    context.max_depth = s.max_depth;
    const auto film_paths = static_cast<double>(s.grid.light_paths_per_spp());
    context.rr_depth = sampling.rr_depth;
    context.strategies = strategies;
    context.kernels = stage_kernels(scene, context.lights);
    context.light_paths = sampling.light_paths;
    context.splat_scale = static_cast<float>(1 / film_paths);
    context.light_samples =
        static_cast<float>(sampling.light_paths * film_paths * sampling.light_tracing_weight);
    context.connections = static_cast<float>(sampling.connections);
    context.imaging_ratio = static_cast<float>(imaging_ratio);
    if (response.is_needed()) context.response = &response;
    context.signed_film = filter.is_signed() || response.is_signed();
    // By the power of lights that are not seen every contribution would be tiny.
    context.tiny_contribution = radiance.by_view ? 0 : tiny_contribution(scene) * context.imaging_ratio;
    return context;
  }

 private:
  /// By camera paths; where they find nothing, by light paths as well. As above, all renderers share it.
  void find_radiance_scale(const RenderSettings& s) {
    RenderSettings settings = s;
    settings.grid.crop = {0, 0, s.grid.width, s.grid.height};
    settings.plan = SamplingPlan{};
    settings.max_depth = kSeenDepth;
    settings.seed = kLearningSeed;
    settings.integrator = Integrator::kPt;
    VisibleRange seen =
        measure_visible_range(learning_context(settings, possible.set & (kEmissionHits | kNextEvent)));
    if (!(seen.bright > 0) && possible.set & kLightPaths) {
      settings.integrator = Integrator::kBdpt;
      seen = measure_visible_range(learning_context(settings, possible.set));
    }
    radiance = radiance_scale(scene, imaging_ratio, seen);
  }
  /// Where paths are to go: a function of the scene, the film's resolution and whether there are light paths;
  /// renderers that differ in all else share it.
  void learn_paths(const RenderSettings& s, int threads) {
    const bool light_paths = s.integrator != Integrator::kPt && possible.set & kLightPaths;
    RenderSettings settings = s;
    settings.grid.crop = {0, 0, s.grid.width, s.grid.height};
    settings.integrator = light_paths ? Integrator::kBdpt : Integrator::kPt;
    settings.plan = SamplingPlan{.connections = kRecordedConnections};
    settings.max_depth = kLearntDepth;
    settings.seed = kLearningSeed;
    const Strategies strategies = light_paths ? possible.set : possible.set & (kEmissionHits | kNextEvent);
    const StageContext context = learning_context(settings, strategies);
    if (strategies & kEmissionHits) train_photon_guide(context, threads, &scene);
    missing = estimate_missing_light(learning_context(settings, strategies), threads);
    train_manifold_seeds(learning_context(settings, strategies), threads, &scene, &missing);
    // Last: the emission guide serves what light paths bring to the camera and are joined to, and would keep
    // them away from what only camera paths meet.
    if (light_paths) train_emission_guide(learning_context(settings, strategies), threads, &scene);
  }
};

struct Renderer::Impl {
  RenderSettings settings;
  std::shared_ptr<const World> world;
  ScenePlan plan;
  std::optional<AllocationTable> allocation;
  PixelInterleave interleave;
  StageContext context;

  Impl(std::shared_ptr<const World> w, const RenderSettings& s, const std::optional<PixelSubset>& of_pilot)
      : settings(s),
        world(std::move(w)),
        plan(analyse_scene(world->scene, world->camera, world->radiance, world->missing, s,
                           world->possible.set, running(s, world->possible))),
        context(of_pilot ? world->learning_context(s, running(s, world->possible))
                         : world->context_of(s, running(s, world->possible))) {
    if (of_pilot) {
      context.pixel_subset = *of_pilot;
    } else {
      interleave = PixelInterleave(s.grid);
      context.interleave = &interleave;
    }
    const SamplingPlan sampling = plan_of(s);
    if (!sampling.allocation.uniform()) {
      allocation.emplace(s.grid, sampling.allocation);
      context.allocation = &*allocation;
    }
    if (s.aovs & kAovLightGroups && s.light_groups != world->scene.light_groups) {
      throw Error(ErrorKind::kUsage, "the settings name other light groups (\"" +
                                         light_groups_text(s.light_groups) + "\") than the scene (\"" +
                                         light_groups_text(world->scene.light_groups) +
                                         "\"): take the settings from this scene");
    }
    if (s.aovs & kAovUv && !world->scene.records_uvs)
      throw std::logic_error("Renderer: a scene that was built without its texture coordinates");
    if (world->filter.is_signed() && s.aovs & (kAovDirect | kAovIndirect)) {
      throw Error(
          ErrorKind::kUsage,
          "direct and indirect light can't be told apart under a filter with negative lobes; leave them "
          "out of --aov, or use another PixelFilter");
    }
  }
};

Renderer::Renderer(SceneDescription scene, const RenderSettings& settings, const BuildOptions& options) {
  const auto world = std::make_shared<World>(std::move(scene), settings, options);
  if (options.when_built) {
    impl_ = std::make_unique<Impl>(world, settings, std::nullopt);
    options.when_built(*this);
    impl_.reset();
  }
  world->learn(settings, options.threads);
  impl_ = std::make_unique<Impl>(world, settings, std::nullopt);
}
Renderer::Renderer(const Renderer& other, const RenderSettings& settings,
                   const std::optional<PixelSubset>& of_pilot)
    : impl_(std::make_unique<Impl>(other.impl_->world, settings, of_pilot)) {}
Renderer::~Renderer() = default;

const ScenePlan& Renderer::plan() const { return impl_->plan; }
std::vector<std::string> Renderer::warnings() const {
  std::vector<std::string> lines;
  for (const Problem& problem : impl_->world->scene.warnings) lines.push_back(format_problem(problem));
  for (const std::string& line : missing_light()) lines.push_back("warning: " + line);
  return lines;
}
std::vector<std::string> Renderer::missing_light() const {
  std::vector<std::string> lines;
  for (const std::string& line : {impl_->plan.lost_light, impl_->plan.missing_light}) {
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}
const RenderSettings& Renderer::settings() const { return impl_->settings; }
int Renderer::quantum_exponent() const {
  return impl_->plan.quantum_exponent + impl_->world->scene.light_exponent;
}
bool Renderer::has_camera_layer() const { return lightmill::has_camera_layer(impl_->settings); }
bool Renderer::has_splat_layer() const { return impl_->context.strategies & kLightTracing; }

AovSpec Renderer::aovs() const {
  const RenderScene& s = impl_->world->scene;
  if (!impl_->settings.aovs) return {};
  return {impl_->settings.aovs,
          {s.scale_exponent, {s.origin.x, s.origin.y, s.origin.z}},
          impl_->settings.light_groups,
          impl_->context.allocation != nullptr};
}

std::unique_ptr<Workspace> Renderer::make_workspace() const { return std::make_unique<WavefrontWorkspace>(); }

void Renderer::render_packet(const Packet& packet, Workspace& workspace, PartialBuilder& builder) const {
  const FlushDenormals flush;
  auto& own = static_cast<WavefrontWorkspace&>(workspace);
  own.record_aovs(builder.aovs());
  lightmill::render_packet(impl_->context, packet, impl_->plan.quantum_exponent, *own.wavefront, &builder);
  impl_->world->scene.textures.throw_if_unreadable();
}

const StageContext& Renderer::context() const { return impl_->context; }

void Renderer::set_probe(Workspace& workspace, StageProbe* probe) {
  static_cast<WavefrontWorkspace&>(workspace).wavefront->probe = probe;
}

uint64_t Renderer::memory_bytes() const {
  return bytes_of(impl_->world->scene) + impl_->world->accel.bytes();
}

RenderCounters Renderer::record_packet(const Packet& packet, Workspace& workspace, PartialBuilder* builder,
                                       StrategyRecorder& recorder) const {
  const FlushDenormals flush;
  Wavefront& w = *static_cast<WavefrontWorkspace&>(workspace).wavefront;
  w.recorder = &recorder;
  lightmill::render_packet(impl_->context, packet, impl_->plan.quantum_exponent, w, builder);
  w.recorder = nullptr;
  impl_->world->scene.textures.throw_if_unreadable();
  return w.counters;
}

Vec3d Renderer::world_point(const float p[3]) const {
  const RenderScene& s = impl_->world->scene;
  const auto axis = [&](float x, double origin) {
    return std::ldexp(static_cast<double>(x), -s.scale_exponent) + origin;
  };
  return {axis(p[0], s.origin.x), axis(p[1], s.origin.y), axis(p[2], s.origin.z)};
}

int Renderer::material_of(int primitive) const {
  return impl_->world->scene.primitive_material[static_cast<size_t>(primitive)];
}

}  // namespace lightmill
