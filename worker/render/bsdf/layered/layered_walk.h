#pragma once
// Light between a coat and its base, from which the tables of the layered BSDFs take their energies when a
// scene is built. Deterministic: the same arguments give the same bits.
#include <vector>

#include "worker/render/bsdf/layered/coat_crossing.h"

namespace lightmill {

/// The part of the light that arrives from outside at `cosine` and gets to the base.
double coat_entering(const CoatDescription& coat, float cosine);
/// The part of what leaves a Lambertian base that the coat returns to it.
double coat_internal_return(const CoatDescription& coat);

/// What leaves the coat, per unit of light that arrives from outside at `cosine`, having met a conductor of
/// roughness `metal_alpha` that reflects everything 1, 2, ... `encounters` times (random walk).
std::vector<double> coated_conductor_orders(const CoatDescription& coat, float metal_alpha, float cosine,
                                            int encounters);

}  // namespace lightmill
