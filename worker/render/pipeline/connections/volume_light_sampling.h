#pragma once
// Points on grids that shine, for next-event estimation and for light paths.
//
// The light is an integral over the volume: of j T / d^2, where j is the radiance per unit length, T the
// transmittance and d the distance. A point is drawn with density p per unit volume: a brick of the grid by
// what leaves it, then a point of the brick, uniformly. Light paths leave it in all directions alike.
//
// A camera path finds such a point by a tentative collision there (walks/volume_walk.h). It has the density
// pdf(wi) m P~ / d^2 per unit volume, where m is the rate of tentative collisions. So m takes the place of
// the cosine at the light, as in all media, and M1, M6 and M7 of mis.h hold with densities per unit volume.
// M10 has no term: what the camera sees of a grid directly only camera paths find.
#include "worker/render/light/direct_sampling.h"
#include "worker/render/light/emission_sampling.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {

/// The lanes whose light is a grid.
inline LaneMask volume_lanes(const LightTable& lights, LaneInt light, LaneMask active) {
  return mask_and(active, LaneMask(gather(lights.type.data(), light) == splat_int<Lane>(kVolumeLight)));
}

/// Completes the lanes of `d` whose light is a grid, seen from `reference` at vertex `depth`, at `time`.
/// Returns the medium that such a shadow ray must end in to count, 0 for other lights: a surface may bound
/// the medium within its grid.
LaneInt sample_volume_lights(const StageContext& context, const Vec3<Lane>& reference,
                             const SampleStream<Lane>& stream, int depth, LaneMask active, Lane time,
                             DirectSample<Lane>* d);

/// Completes the lanes of `e` whose light is a grid. (pu, pv) and (du, dv) choose point and direction;
/// `times` of the paths, or null. Paths that would start beyond a boundary of the medium have no power. `pdf`
/// and `cos_light` lack the density p, which would cancel: M1 divides by it what M1 multiplies by it at the
/// first hit.
void sample_volume_emission(const StageContext& context, const SampleStream<Lane>& stream, Lane pu, Lane pv,
                            Lane du, Lane dv, const float* times, LaneMask active, EmissionSample<Lane>* e);

}  // namespace lightmill
