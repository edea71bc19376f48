#include "worker/render/pipeline/recording/motion_vectors.h"

#include <variant>

#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/scene/geometry/placement.h"
#include "worker/render/scene/geometry/triangle_hit.h"

namespace lightmill {
namespace {

/// Of a point of normalised space, seen by the camera at rest.
LensConnection<Lane> on_film(const Camera& camera, const Vec3<Lane>& p) {
  if (const auto* lens = std::get_if<ThinLensCamera>(&camera))
    return lens->pinhole.connect(p, Lane{}, Lane{});
  if (const auto* lens = std::get_if<ParallelLensCamera>(&camera))
    return lens->window.connect(p, Lane{}, Lane{});
  return std::visit([&](const auto& c) { return c.connect(p, Lane{}, Lane{}); }, camera);
}

/// Where points of triangles that may bend are in their object's space at times 0 and 1. `o`, `d`: the rays
/// there, which meet them at `time`.
std::array<Vec3<Lane>, 2> ends_of_bending(const RenderScene& scene, LaneInt tri, const Vec3<Lane>& o,
                                          const Vec3<Lane>& d, Lane time) {
  Vec3<Lane> rounded[3];
  const TriangleHit<Lane> hit =
      bent_triangle_hit<Lane>(scene, tri, o, d, BendStep<Lane>(scene, tri, time), rounded);
  const auto at = [&](float t) {
    const BendStep<Lane> step(scene, tri, splat<Lane>(t));
    const float* p = scene.positions.data();
    return step.at(p, hit.i0) * hit.b0 + step.at(p, hit.i1) * hit.b1 + step.at(p, hit.i2) * hit.b2;
  };
  return {at(0), at(1)};
}

/// Where the points that were hit are at times 0 and 1.
std::array<Vec3<Lane>, 2> ends_of(const RenderScene& scene, const Hit& hit, LaneMask active, Lane time) {
  std::array<Vec3<Lane>, 2> ends{hit.v.p, hit.v.p};
  const LaneInt instance = hit.path.instance, prim = hit.path.prim;
  if (scene.ways.empty()) return ends;
  const LaneMask moves = mask_and(active, LaneMask(instance >= scene.first_moving));
  if (!any(moves)) return ends;
  const auto placed = Placement<Lane>::at(scene, instance, time);
  const Vec3<Lane> p = placed.origin(hit.v.p);
  std::array<Vec3<Lane>, 2> inside{p, p};
  if (scene.any_bending()) {
    const LaneMask is_triangle = LaneMask(prim < scene.triangle_count());
    const std::array<Vec3<Lane>, 2> bent =
        ends_of_bending(scene, select(is_triangle, prim, LaneInt{}), placed.origin(hit.path.origin),
                        placed.direction(hit.path.direction), time);
    for (size_t end = 0; end < 2; ++end) inside[end] = select(is_triangle, bent[end], p);
  }
  for (size_t end = 0; end < 2; ++end) {
    const auto then = Placement<Lane>::at(scene, instance, splat<Lane>(static_cast<float>(end)));
    ends[end] = select(moves, then.point(inside[end]), hit.v.p);
  }
  return ends;
}

}  // namespace

std::array<Lane, 2> motion_on_film(const StageContext& context, const Hit& hit, LaneMask active, Lane time) {
  const RenderScene& scene = context.scene;
  const CameraMotion& motion = scene.camera_motion;
  std::array<Vec3<Lane>, 2> ends = ends_of(scene, hit, active, time);
  if (motion.moves) {
    for (size_t end = 0; end < 2; ++end)
      ends[end] = motion.at_rest(ends[end], splat<Lane>(static_cast<float>(end)));
  }
  const LensConnection<Lane> from = on_film(context.camera, ends[0]), to = on_film(context.camera, ends[1]);
  const LaneMask seen = mask_and(active, mask_and(from.seen, to.seen));
  Lane x = to.x - from.x;
  // Of a panorama that closes: the shorter way round.
  if (const SphericalCamera* sphere = round_sphere(context.camera); sphere && !sphere->equal_area)
    x = x - sphere->width * floor(x * sphere->inv_width + 0.5f);
  return {select(seen, x, Lane{}), select(seen, to.y - from.y, Lane{})};
}

}  // namespace lightmill
