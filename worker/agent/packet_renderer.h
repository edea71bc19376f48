#pragma once
// What the agent needs of a renderer, so that tests can run the agent without Embree.
#include <functional>
#include <memory>

#include "common/film/partial.h"
#include "common/image/image.h"
#include "common/job/pilot_report.h"
#include "common/job/settings.h"
#include "common/scene/description.h"
#include "worker/render/renderer.h"

namespace lightmill::agent {

class PacketRenderer {
 public:
  virtual ~PacketRenderer() = default;
  virtual const FilmGrid& grid() const = 0;
  virtual int quantum_exponent() const = 0;
  virtual bool has_camera_layer() const = 0;
  virtual bool has_splat_layer() const = 0;
  virtual AovSpec aovs() const { return {}; }
  /// Renderer::missing_light().
  virtual std::vector<std::string> missing_light() const { return {}; }
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  /// Thread-safe for distinct workspaces.
  virtual void render_packet(const Packet& packet, Workspace& workspace, PartialBuilder& builder) const = 0;
  /// Memory of the scene, which is shared by all that with_settings made of it.
  virtual uint64_t memory_bytes() const { return 0; }
  /// A small picture to look at before that, first_look.h; without pixels: none. Throws as run_pilot().
  virtual Image first_look(int threads, const std::function<bool()>& go_on) const {
    (void)threads, (void)go_on;
    return {};
  }
  /// Chooses the sampling plan, on `threads` threads. Throws Error(kFailed) once `go_on` gives false.
  virtual PilotReport run_pilot(int threads, const std::function<bool()>& go_on) const = 0;
  /// The same scene, shared, under settings that differ in plan, integrator, depth, seed or stop rule only.
  virtual std::shared_ptr<const PacketRenderer> with_settings(const RenderSettings& settings) const = 0;
};

/// The renderer itself. Throws as Renderer's constructor does. `warn` is called with Renderer::warnings().
std::shared_ptr<const PacketRenderer> make_packet_renderer(
    SceneDescription scene, const RenderSettings& settings, const BuildOptions& options,
    const std::function<void(const std::string&)>& warn = [](const std::string&) {});

/// Who wants a first look (first_look.h) at a scene. Neither throws.
struct LookWanted {
  std::function<bool()> go_on;
  std::function<void(const Image&)> show;
};

/// Where the runner gets the renderer of a lease from.
class RenderSource {
 public:
  virtual ~RenderSource() = default;
  /// Called by one thread. `look`, unless null, is shown the scene if it has to be built, as soon as it can
  /// be seen. Throws Error if the scene can't be rendered here (the lease is failed with its text) and
  /// LinkDown if it can't be fetched now.
  virtual std::shared_ptr<const PacketRenderer> open(const std::string& bundle_digest,
                                                     const RenderSettings& settings,
                                                     const LookWanted* look) = 0;
  /// A file that holds this blob; empty: it is not here. Any thread.
  virtual std::string find_blob(const std::string& digest) const {
    (void)digest;
    return {};
  }
};

}  // namespace lightmill::agent
