#pragma once
// The acceleration structure: which primitive does a ray hit first, is a segment free.
//
// Hides the ray tracing library: nothing else includes its headers. The device is pinned to
// AVX2 and the scene is built ROBUST, so that packets, single rays and any number of build
// threads name the same primitives. Scenes of few primitives have no tree (few_primitives.h).
#include <cstdint>
#include <memory>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Rays in structure-of-arrays form; arrays of at least `count` floats.
struct RayView {
  const float *ox, *oy, *oz, *dx, *dy, *dz;
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

  /// For i < count: primitive number hit first by ray ids[i], in (0, infinity), to prim[ids[i]]; -1 if none.
  /// The instance that it is hit in, or -1, goes to instance[ids[i]], which may be null if the scene has
  /// none.
  void closest_hits(const RayView& rays, const int32_t* ids, int count, int32_t* prim,
                    int32_t* instance = nullptr) const;
  /// For i < count: occluded[i] = 1 if anything lies on ray i in (0, tfar[i]), else 0.
  void occluded(const RayView& rays, const float* tfar, int count, uint8_t* occluded) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
