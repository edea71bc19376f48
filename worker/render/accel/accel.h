#pragma once
// The acceleration structure: which primitive does a ray hit first, is a segment free.
//
// Hides the ray tracing library: nothing else includes its headers. The device is pinned to
// AVX2 and the scene is built ROBUST, so that packets, single rays and any number of build
// threads name the same primitives, and closed meshes are closed (watertight_test.cc). Scenes of few
// primitives have no tree (few_primitives.h).
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "common/scene/visibility/ray_kinds.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A ray and what it hits first.
struct alignas(32) TracedRay {
  float origin[3], direction[3];
  int32_t prim, instance;  // -1: none
};
/// Their floats, the integers by bits.
inline float (*as_records(TracedRay* rays))[8] { return reinterpret_cast<float(*)[8]>(rays); }
inline const float (*as_records(const TracedRay* rays))[8] {
  return reinterpret_cast<const float(*)[8]>(rays);
}
static_assert(sizeof(TracedRay) == 8 * sizeof(float));

/// Segments in structure-of-arrays form; arrays of at least `count` floats.
struct RayView {
  const float *ox, *oy, *oz, *dx, *dy, *dz;
  const float* time = nullptr;  // in [0, 1]; null: 0, or nothing moves
};

/// The kinds of rays: ray i is of[i], where that is given; else all are of `all`.
struct KindsOfRays {
  const RayKinds* of = nullptr;
  RayKinds all = kAllRays;
  RayKinds operator[](int32_t i) const { return of ? of[i] : all; }
};

/// What the rays of a wavefront have been let through by, each by its id. Rays go on through that, and are
/// stopped by all else that stops a part of them (alpha_mask.h), whose share the caller decides.
struct PassedSurfaces {
  static constexpr int kMost = 6;  // of a ray; then hashes decide, as they do without a list
  struct OfRay {
    int32_t count;
    int32_t prim[kMost], instance[kMost];
  };
  std::vector<OfRay> of;

  bool full(size_t ray) const { return of[ray].count == kMost; }
  bool holds(size_t ray, int32_t prim, int32_t instance) const;
  void add(size_t ray, int32_t prim, int32_t instance);
};

enum class Structure { kFastest, kTree };

class Accel {
 public:
  /// Builds over `scene` (which must outlive it) with `threads` threads (0: all). The two structures name
  /// different primitives only where rays pass within rounding of an edge.
  Accel(const RenderScene& scene, int threads, Structure structure = Structure::kFastest);
  ~Accel();
  Accel(const Accel&) = delete;
  Accel& operator=(const Accel&) = delete;

  /// Sets the primitive that ray ids[i], i < count, hits first in (0, infinity), and the instance that it is
  /// hit in. Its time is times[ids[i]], in [0, 1]; null: 0, or nothing moves. Its kinds are kinds[ids[i]].
  /// `passed`: null, or that of rays 0 to the largest id.
  void closest_hits(TracedRay* rays, const int32_t* ids, int count, const float* times = nullptr,
                    KindsOfRays kinds = {}, const PassedSurfaces* passed = nullptr) const;
  /// For i < count: occluded[i] = 1 if anything lies on ray i in (0, tfar[i]), else 0. With `crossed`, what
  /// light passes straight (boundaries of media, panes) stops no ray, and crossed[i] = 1 if such may lie on
  /// it.
  void occluded(const RayView& rays, const float* tfar, int count, uint8_t* occluded,
                uint8_t* crossed = nullptr, RayKinds kinds = kAllRays) const;
  /// Memory of the tree.
  uint64_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
