#pragma once
// Sampling of lights in both directions, over a lane type.
//
// direct:   from a reference point towards a light; densities per unit solid angle at the reference point.
// emission: a ray that leaves a light; density per unit area x unit solid angle.
//
// All densities include the probability of selecting the light. If there is a light tree, that differs
// between the two directions. A point or spot light's direct density is distance^2 x selection, so radiance /
// pdf = I / (d^2 p). A distant light's is the selection alone.
#include "worker/render/light/direct_sampling.h"
#include "worker/render/light/emission_sampling.h"
