#pragma once
// Portals of infinite lights: light comes only along rays through a rectangle, as through the window of a
// room that has no other openings (pbrt's "portal"). Next-event estimation draws half of the directions by
// area on the rectangle, so that small windows are found, and half by the image, so that a sun in it is found
// (one-sample MIS with the balance heuristic: Veach 1997, 9.2.4). Light paths start in front of everything,
// on lines through a point of the rectangle.
#include <array>

#include "common/scene/description.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// In normalised space.
struct Portal {
  Vec3f corner, edge1, edge2, normal;  // the normal is unit and points out, to the light
  float length1_squared = 0, length2_squared = 0, area = 0;
  float reach = 0;  // how far out of the rectangle light paths start
};

/// The rectangle `corners`, whose normal is (fourth - first) x (second - first), in a scene inside a ball
/// around `center`.
Portal make_portal(const std::array<Vec3d, 4>& corners, const float center[3], float radius);

/// Whether the ray from `o` in unit direction `w` leaves through the portal.
template <class F>
inline MaskOf<F> passes(const Portal& p, const Vec3<F>& o, const Vec3<F>& w) {
  const Vec3<F> n = splat3<F>(p.normal.x, p.normal.y, p.normal.z);
  const Vec3<F> to_corner = splat3<F>(p.corner.x, p.corner.y, p.corner.z) - o;
  const F cosine = dot(w, n), height = dot(to_corner, n);
  const MaskOf<F> outwards = mask_and(MaskOf<F>(cosine > 0.0f), MaskOf<F>(height >= 0.0f));
  // The place on the rectangle, times the cosine: steep rays divide by next to nothing.
  const Vec3<F> at = w * height - to_corner * cosine;
  const F a = dot(at, splat3<F>(p.edge1.x, p.edge1.y, p.edge1.z));
  const F b = dot(at, splat3<F>(p.edge2.x, p.edge2.y, p.edge2.z));
  const MaskOf<F> in_a = mask_and(MaskOf<F>(a >= 0.0f), MaskOf<F>(a <= cosine * p.length1_squared));
  const MaskOf<F> in_b = mask_and(MaskOf<F>(b >= 0.0f), MaskOf<F>(b <= cosine * p.length2_squared));
  return mask_and(outwards, mask_and(in_a, in_b));
}

template <class F>
inline Vec3<F> portal_point(const Portal& p, F u, F v) {
  return splat3<F>(p.corner.x, p.corner.y, p.corner.z) + splat3<F>(p.edge1.x, p.edge1.y, p.edge1.z) * u +
         splat3<F>(p.edge2.x, p.edge2.y, p.edge2.z) * v;
}

/// Cosine of the angle between unit direction `w` and the way out.
template <class F>
inline F portal_cosine(const Portal& p, const Vec3<F>& w) {
  return dot(w, splat3<F>(p.normal.x, p.normal.y, p.normal.z));
}

/// Density per unit solid angle at `o` of drawing unit direction `w`, which passes the portal, by area.
template <class F>
inline F portal_area_pdf(const Portal& p, const Vec3<F>& o, const Vec3<F>& w) {
  const F cosine = portal_cosine(p, w);
  const F height =
      dot(splat3<F>(p.corner.x, p.corner.y, p.corner.z) - o, splat3<F>(p.normal.x, p.normal.y, p.normal.z));
  const MaskOf<F> outwards = MaskOf<F>(cosine > 0.0f);
  const F safe = select(outwards, cosine, splat<F>(1.0f)), distance = height / safe;
  return select(outwards, distance * distance / (safe * p.area), F{});
}

/// Density per unit area across unit direction `w` of points drawn evenly on the portal; 1 where `w` faces
/// its back.
template <class F>
inline F portal_point_pdf(const Portal& p, const Vec3<F>& w) {
  const F cosine = portal_cosine(p, w);
  return 1.0f / select(MaskOf<F>(cosine > 0.0f), cosine * p.area, splat<F>(1.0f));
}

}  // namespace lightmill
