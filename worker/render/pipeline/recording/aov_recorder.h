#pragma once
// Records what AOVs (common/job/aovs.h) need of the camera paths, one sample of a cell at a time. A wavefront
// has a recorder only where a tile's builder asks for AOVs. It changes neither a path nor what it
// contributes.
#include <array>
#include <span>
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/recording/group_recorder.h"
#include "worker/render/pipeline/recording/lobe_recorder.h"
#include "worker/render/pipeline/recording/matte_recorder.h"

namespace lightmill {

struct Packet;  // renderer.h
struct Hit;     // path_vertex.h

class AovRecorder {
 public:
  explicit AovRecorder(const AovSpec& spec) : spec_(spec), groups_(spec.groups), lobes_(spec.set) {}
  const AovSpec& spec() const { return spec_; }

  void begin_packet();
  void begin_layer(const Wavefront& w);
  /// Takes camera paths' hits of surfaces at `depth`, before anything is sampled there.
  void hits(const StageContext& context, const Hit& hit, LaneMask active, int depth, const Paths& paths);
  /// Takes camera paths that scatter in a medium. They have no first surface, like those that escape.
  void ends_in_medium(LaneInt slot, LaneMask active);
  /// Whether camera paths without a contribution need not be followed any further.
  bool first_hits_done(const Paths& paths) const;

  // Direct light of camera paths is what their radiance grows by where one scattering event at most has
  // happened: emission and next event at the first vertex, emission at the second.
  bool wants_direct() const { return needs_layer(spec_.set, kDirectLayer); }
  void direct_so_far(const Wavefront& wavefront);
  void begin_indirect(const Wavefront& wavefront);
  void end_direct(const Wavefront& wavefront);
  void direct_splats(std::span<const Splat> splats);

  GroupRecorder& groups() { return groups_; }
  LobeRecorder& lobes() { return lobes_; }

  /// Rounds the sample's values and adds them to the cell's sums.
  void finish_layer(const StageContext& context, int quantum_exponent, const Wavefront& wavefront);
  void finish_packet(const Packet& packet, const RenderScene& scene, PartialBuilder& builder);

 private:
  bool wants_albedo() const {
    return needs_layer(spec_.set, kAlbedoLayer) || needs_layer(spec_.set, kDiffuseAlbedoLayer);
  }
  /// Whether the first surface that is not purely specular matters.
  bool wants_surfaces() const { return wants_albedo() || spec_.set & kAovNormal; }

  AovSpec spec_;
  // Of the sample at hand, by path slot.
  alignas(32) float albedo_[3][kWavefront], diffuse_[3][kWavefront], normal_[3][kWavefront],
      position_[3][kWavefront];
  alignas(32) float depth_[kWavefront], uv_[2][kWavefront], motion_[2][kWavefront];
  alignas(32) float direct_[3][kWavefront], before_[3][kWavefront];
  float weight_[kWavefront];  // of the sample, whatever the sensor makes of it later
  uint8_t hit_[kWavefront], surface_found_[kWavefront];
  std::array<std::vector<ExactRgb>, kAovLayers> sums_;  // of the packet's cell
  std::vector<Splat> direct_splats_;
  GroupRecorder groups_;
  LobeRecorder lobes_;
  MatteRecorder mattes_;
};

}  // namespace lightmill
