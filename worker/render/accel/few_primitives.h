#pragma once
// Scenes of few primitives without a tree: every face (faces.h) and sphere is tested against eight rays at
// once, which costs less than finding out which to test.
//
// Faces that share an edge agree on which side of it a ray passes: none slips between them, as with the
// library's ROBUST flag (the idea of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", 2013).
// Spheres are those of sphere_hit.h, behind a test in float that lets no hit go.
#include "worker/render/accel/accel.h"
#include "worker/render/accel/faces.h"

namespace lightmill {

class FewPrimitives {
 public:
  /// Whether `scene` is one: few primitives, opaque and not in instances.
  static bool suits(const RenderScene& scene);

  /// Of the world of `scene`, which need not outlive it.
  explicit FewPrimitives(const RenderScene& scene);

  /// As Accel's.
  void closest_hits(TracedRay* rays, const int32_t* ids, int count) const;
  void occluded(const RayView& rays, const float* tfar, int count, uint8_t* occluded, uint8_t* crossed) const;

 private:
  struct Rays;  // eight of them
  template <class Found>
  void for_each_hit(const Rays& r, Found&& found) const;

  FaceTable table_;
  std::vector<bool> passed_;    // per face, then per sphere: light passes it, or half of it, straight
  std::vector<float> spheres_;  // as RenderScene::spheres
  int32_t triangles_;
};

}  // namespace lightmill
