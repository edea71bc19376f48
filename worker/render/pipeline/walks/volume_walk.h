#pragma once
// The part of a segment that lies in a grid (scene/media/volume_table.h).
//
// Null-collision tracking (Woodcock; survey: Novak et al. 2018) against the majorant m of each brick, which
// the way meets one after the other. Tentative collisions come at the rate m in all channels alike. One at x
// is a real collision with probability mu_c(x) / m in the channel c that was drawn for the segment, else a
// null one. So with
//   P_c = product over the null collisions x of (1 - mu_c(x) / m)
// a segment that ends at x_e has the density sum_c w_c mu_c(x_e) P_c, times one of where the tentative
// collisions lie that is the same for all channels and for connections. It cancels: medium_walk.h's formulas
// hold with this P_c, and it is also the estimate of the transmittance by a connection, whose tentative
// collisions are all null (ratio tracking). This is MIS in the space of paths with null vertices (Miller,
// Georgiev and Jarosz 2019): P~ of mis.h is the mean of P_c, known to whoever made the segment.
//
// Bricks whose majorant is negative are integrated, cell by cell: along a straight line in a cell the value
// is a cubic, so four of its values give the optical depth exactly. Collisions there are found by bisection.
// Which bricks those are depends on the brick alone, so that both ends of a segment agree.
//
// What shines is added at every tentative collision: radiance per length over m. Where the segment comes from
// a vertex at which next-event estimation could have drawn the point, it has the weight of M6
// (connections/volume_light_sampling.h).
#include "worker/render/math/exp.h"
#include "worker/render/pipeline/walks/volume_way.h"
#include "worker/render/sampling/sobol.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Uniform number `index` of a walk's seed.
inline Lane walk_number(UintOf<Lane> seed, LaneInt index) {
  return unit_float<Lane>(hash32(seed + as_uint(index) * 0x9e3779b9u));
}
/// Optical depth to the next tentative collision, by a number of the walk.
inline Lane walk_depth(UintOf<Lane> seed, LaneInt index) {
  const Lane u = walk_number(seed, index);
  return minus_log_one_minus(u + 0x1p-25f, (1.0f - u) - 0x1p-25f);
}

/// Walks each way until it ends or a path does. `shines`: what is emitted is wanted.
void walk_through_volumes(const RenderScene& scene, bool shines, VolumeWays* ways);
/// The same for connections, which nothing ends.
void pass_through_volumes(const RenderScene& scene, VolumeWays* ways);

}  // namespace lightmill
