#pragma once
// Sampling of lights in both directions, over a lane type.
//
// direct:   from a reference point towards a light; densities per unit solid angle at the reference point.
// emission: a ray that leaves a light; density per unit area x unit solid angle.
// All densities include the probability of selecting the light, which is another one for each direction when
// there is a light tree. A point or spot light's direct density is distance^2 x selection, so that
// radiance / pdf = I / (d^2 p); a distant light's is the selection alone.
#include "worker/render/light/direct_sampling.h"
#include "worker/render/light/emission_sampling.h"
