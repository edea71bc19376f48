#pragma once
// The renderer: a scene under fixed settings, ready to render packets. Pure: a packet's contribution is a
// function of (scene, settings, packet) alone. No gRPC here; Embree stays behind accel/.
//
//   Renderer renderer(scene, settings, threads);
//   auto workspace = renderer.make_workspace();            // one per thread
//   renderer.render_packet({cx, cy, s0, s1}, *workspace, builder);
#include <cstdint>
#include <memory>
#include <optional>

#include "common/film/partial.h"
#include "common/job/settings.h"
#include "common/scene/description.h"
#include "worker/render/build_options.h"
#include "worker/render/pipeline/pixel_subset.h"
#include "worker/render/plan/analysis/scene_plan.h"

namespace lightmill {

/// One cell x one block (or the part of a block that a tile covers).
struct Packet {
  int cell_x = 0, cell_y = 0;
  int64_t sample_begin = 0, sample_end = 0;  // within one block
};

class StageProbe;        // recording/stage_probe.h
class StrategyRecorder;  // recording/strategy_recorder.h
struct StageContext;     // pipeline/context.h

/// A thread's private wavefront, light-vertex cache and buffers.
class Workspace {
 public:
  virtual ~Workspace() = default;
};

class Renderer {
 public:
  /// Builds the scene and its acceleration structure, and freezes the plan. Throws
  /// Error(kBadScene) for geometry that can't be rendered and images that can't be read. Who moves the scene
  /// here saves the memory of its meshes.
  Renderer(SceneDescription scene, const RenderSettings& settings, const BuildOptions& options);
  ~Renderer();
  /// The scene of `other`, shared, under settings that differ from its own in plan, integrator, depth,
  /// samples or seed at most. What the scene was built from stays: that of path tracing alone has no guide
  /// for light paths. A pilot renders the pixels `of_pilot` only, and its cells' pixels lie beside each
  /// other.
  Renderer(const Renderer& other, const RenderSettings& settings,
           const std::optional<PixelSubset>& of_pilot = {});
  const ScenePlan& plan() const;
  /// What the scene says and could not be taken at its word, each with its place, and what light the settings
  /// leave out: a line each.
  std::vector<std::string> warnings() const;
  /// The latter alone.
  std::vector<std::string> missing_light() const;
  const RenderSettings& settings() const;
  /// That the scene takes, which renderers of other settings share.
  uint64_t memory_bytes() const;
  int quantum_exponent() const;
  bool has_camera_layer() const;  // false for lt without AOVs
  bool has_splat_layer() const;   // false for pt
  /// What builders of this renderer's tiles are made with; a builder without AOVs gets none.
  AovSpec aovs() const;
  std::unique_ptr<Workspace> make_workspace() const;
  /// Renders one packet into `builder`. Thread-safe for distinct workspaces. Throws Error(kBadScene) if an
  /// image that was not kept in memory can't be read any more.
  void render_packet(const Packet& packet, Workspace& workspace, PartialBuilder& builder) const;
  /// The same, told to `recorder` contribution by contribution: slow, for diagnosis and pilots, which need no
  /// builder.
  RenderCounters record_packet(const Packet& packet, Workspace& workspace, PartialBuilder* builder,
                               StrategyRecorder& recorder) const;
  /// For benches: what the stages read, and a probe (or null) that records while packets are rendered with
  /// `workspace`.
  const StageContext& context() const;
  static void set_probe(Workspace& workspace, StageProbe* probe);
  /// A point of normalised space (what a recorder gives) in the scene file's world space.
  Vec3d world_point(const float normalised[3]) const;
  /// Index into SceneDescription::materials of a primitive.
  int material_of(int primitive) const;

 private:
  struct World;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
