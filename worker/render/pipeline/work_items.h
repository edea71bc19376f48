#pragma once
// All data that passes between the stages of a wavefront.
//
//   producer -> paths -> caster -> (prim) -> bouncer -> vertices -> shadow caster -> shadow rays -> film
//
// One thread owns a wavefront; nothing here is shared. A wavefront works on one cell and one sample index at
// a time. Slot i of the camera paths is pixel i of the cell (row-major), except under adaptive sampling
// (camera_pass.h). Light paths belong to the layer as a whole: their vertices form its light-vertex cache,
// from which camera vertices draw.
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/film/partial.h"
#include "common/job/light_groups.h"
#include "common/job/lobes.h"
#include "common/job/packet_grid.h"
#include "worker/render/accel/accel.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/vec.h"
#include "worker/render/pipeline/camera_pass.h"
#include "worker/render/pipeline/mis.h"

namespace lightmill {

/// The lane type of the pipeline. `float` gives the same bits.
using Lane = Float8;
using LaneInt = IntOf<Lane>;
using LaneMask = MaskOf<Lane>;
inline constexpr int kLanes = kWidth<Lane>;
inline constexpr int kWavefront = kCellPixels;

/// Live subpaths: the ray to cast next and what it carries, by path slot. Lanes take eight records at a time
/// and transpose them, which is quicker than gathering field by field (path_io.h).
struct Paths {
  enum Carried { kThroughput = 0, kDvcm = 3, kDvc = 4, kLight = 5, kCosLight = 6, kMedium = 7 };
  TracedRay rays[kWavefront];
  alignas(32) float carried[kWavefront][8];  // integers by bits; kLight, kCosLight are of light paths alone
  alignas(32) int32_t active[kWavefront + kLanes];  // slots with a ray, `active_count` of them
  alignas(32) float time[kWavefront];               // in [0, 1]; set if anything moves
  alignas(32) RayKinds kinds[kWavefront];           // of camera paths' rays; set if the scene hides something
  int active_count = 0;

  /// Ends the paths whose slots are set in `ended`.
  void end(const std::array<bool, kWavefront>& ended) {
    int left = 0;
    for (int i = 0; i < active_count; ++i) {
      if (!ended[static_cast<size_t>(active[i])]) active[left++] = active[i];
    }
    active_count = left;
  }
};

/// A vertex that can be connected, on a surface or in a medium: 32 floats, two cache lines. Integers are
/// stored by bits.
struct alignas(64) Vertex {
  enum Slot {
    kP = 0,
    kError = 3,
    kNg = 4,
    kNs = 7,
    kWo = 10,
    kThroughput = 13,
    kDvcm = 16,
    kDvc = 17,
    kKind = 18,
    kPathAndDepth = 19,  // slot + (group << kGroupShift) + kUnseen, if so, + (depth << kDepthShift)
    kParams = 20,
    kGuide = 30,  // see VertexLanes
    kMedia = 31   // sides (medium.h)
  };
  static constexpr int kGroupShift = 10, kDepthShift = 16, kUnseen = 1 << 15;
  static_assert(kWavefront == 1 << kGroupShift && kMaxLightGroups <= kUnseen >> kGroupShift);
  float f[32];
  Vertex() {}  // not zeroed: the code that appends one fills it
  Vec3<float> vec(int slot) const { return {f[slot], f[slot + 1], f[slot + 2]}; }
  int32_t path() const { return std::bit_cast<int32_t>(f[kPathAndDepth]) & (kWavefront - 1); }
  BsdfKind kind() const { return static_cast<BsdfKind>(std::bit_cast<int32_t>(f[kKind])); }
  int32_t depth() const { return std::bit_cast<int32_t>(f[kPathAndDepth]) >> kDepthShift; }
};

/// Connections whose contribution is known and not zero. They wait for their visibility.
struct ShadowRays {
  static constexpr int kCapacity = 4096;
  alignas(32) float ox[kCapacity], oy[kCapacity], oz[kCapacity];
  alignas(32) float dx[kCapacity], dy[kCapacity], dz[kCapacity];
  alignas(32) float tfar[kCapacity];
  float r[kCapacity], g[kCapacity], b[kCapacity];
  int32_t target[kCapacity];  // path slot, or of a splat SplatTarget::pixel
  int32_t group[kCapacity];   // light group; set with Wavefront::groups
  // Of splats: place on the raster, and a uniform number for small filter weights.
  float raster_x[kCapacity], raster_y[kCapacity], small_choice[kCapacity];
  float time[kCapacity];  // set if an instance moves
  uint8_t occluded[kCapacity];
  int count = 0;
};

/// What a wavefront keeps of light groups (common/job/light_groups.h) while a tile records them.
struct GroupedLight {
  explicit GroupedLight(size_t groups) : count(groups), radiance(groups * kWavefront) {}
  void add(int32_t group, size_t slot, float r, float g, float b) {
    std::array<float, 3>& sum = radiance[slot * count + static_cast<size_t>(group)];
    sum[0] += r;
    sum[1] += g;
    sum[2] += b;
  }
  const size_t count;
  std::vector<std::array<float, 3>> radiance;    // of camera paths, by slot and group
  alignas(32) int32_t of_path[kWavefront] = {};  // of light paths, by slot
  std::vector<uint8_t> splat_groups;             // of Wavefront::splats
};

/// Which of the lobes (common/job/lobes.h) contributions belong to. Of reflections `part` is a glossy one,
/// and the share `diffuse` of each channel belongs to the diffuse one in its stead; of others it is 0.
struct LobeLanes {
  LaneInt part{};
  Vec3<Lane> diffuse{};
};
/// One lane of it.
struct LobeOf {
  int32_t part = 0;
  std::array<float, 3> diffuse{};
};
inline constexpr int32_t kGlossyToDiffuse = kGlossyDirect - kDiffuseDirect;

/// What a wavefront keeps of lobes while a tile records them.
struct LobedLight {
  GroupedLight light{kLobeParts};  // with parts for groups
  // The first event of camera paths, by slot: as LobeLanes, of direct light.
  alignas(32) int32_t event[kWavefront];
  alignas(32) float diffuse[3][kWavefront];
  // Of ShadowRays.
  alignas(32) int32_t shadow_part[ShadowRays::kCapacity];
  alignas(32) float shadow_diffuse[3][ShadowRays::kCapacity];
  std::vector<std::array<float, 3>> splat_diffuse;  // of Wavefront::splats: what of them is diffuse

  LobeOf of_shadow_ray(size_t i) const {
    return {shadow_part[i], {shadow_diffuse[0][i], shadow_diffuse[1][i], shadow_diffuse[2][i]}};
  }
  void add(const LobeOf& lobe, size_t slot, float r, float g, float b) {
    const float dr = r * lobe.diffuse[0], dg = g * lobe.diffuse[1], db = b * lobe.diffuse[2];
    light.add(lobe.part, slot, r - dr, g - dg, b - db);
    if (lobe.part == kGlossyDirect || lobe.part == kGlossyIndirect)
      light.add(lobe.part - kGlossyToDiffuse, slot, dr, dg, db);
  }
};

class StrategyRecorder;  // strategy_recorder.h
class AovRecorder;       // aov_recorder.h
class StageProbe;        // stage_probe.h
struct AlphaWork;
struct MediaWork;     // medium_walk.h
struct BodyWalks;     // subsurface_walk.h
struct ManifoldWork;  // manifold_next_event.h

/// Everything that a thread needs to render packets.
struct Wavefront {
  CameraSlots slots;
  Paths paths;
  std::vector<Vertex> light_vertices;  // the packet layer's light-vertex cache, in order of creation
  std::vector<Vertex> vertices;        // vertices of the current bounce that can be connected
  ShadowRays shadow;
  alignas(32) float radiance_r[kWavefront], radiance_g[kWavefront], radiance_b[kWavefront];
  std::vector<Splat> splats;
  std::vector<ExactRgb> camera_sums;  // the packet's cell
  std::vector<int32_t> sorted;        // the bouncer's counting sort
  RenderCounters counters;
  Dropped dropped, dropped_light;        // of camera paths, and of light paths before they are splats
  StrategyRecorder* recorder = nullptr;  // not owned; null but for diagnosis
  AovRecorder* aovs = nullptr;           // not owned; null unless the tile has AOVs
  GroupedLight* groups = nullptr;        // not owned; null unless the tile records two light groups or more
  LobedLight* lobes = nullptr;           // not owned; null unless the tile records lobes
  StageProbe* probe = nullptr;           // not owned; null but for benches
  std::shared_ptr<AlphaWork> alphas;     // null unless surfaces stop a part of the rays, and without media
  std::shared_ptr<MediaWork> media;      // null unless the scene has media
  std::shared_ptr<BodyWalks> bodies;     // null unless light walks through bodies
  std::shared_ptr<ManifoldWork> manifolds;  // null unless the scene has seeds of manifold walks
};

}  // namespace lightmill
