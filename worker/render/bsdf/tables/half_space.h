#pragma once
// How much of diffuse light a deep homogeneous medium returns, in closed form.
//
// Van de Hulst (1980, "Multiple light scattering", vol. 2) found that a half space with single-scattering
// albedo a and mean cosine g returns nearly what its similarity parameter s = sqrt((1 - a) / (1 - a g)) says:
//   R = (1 - s) (1 - 0.139 s) / (1 + 1.17 s)
// Against adding and doubling it is off by 0.002 at most for 0 <= g <= 0.9, and by 0.01 for g = -1/2
// (tests/worker/render/bsdf/subsurface_test.cc).
//
// Below a boundary that lets the part l of what meets it from inside leave, and reflects the rest diffusely
// (subsurface.h), the body returns l R / (1 - (1 - l) R) of what enters.
//
// A body given by its coefficients has a boundary that refracts: what enters goes deep, steeply, and what
// comes back grazing stays inside. Below a Lambertian one the same medium would return up to a fifth more. So
// its walk has another albedo, with which a deep body returns what it does behind a boundary that refracts,
// by adding and doubling.
#include "worker/render/bsdf/layered/coat_crossing.h"
#include "worker/render/math/lanes.h"

namespace lightmill {

/// Part of what enters a deep body that leaves it again.
template <class F>
inline F body_reflectance(F albedo, F leaves, F g) {
  const F s = safe_sqrt((1.0f - albedo) / (1.0f - albedo * g));
  const F r = (1.0f - s) * (1.0f - 0.139f * s) / (1.0f + 1.17f * s);
  return leaves * r / (1.0f - (1.0f - leaves) * r);
}

/// Its inverse: the single-scattering albedo of a body that returns `reflectance`, in [0, 1].
float albedo_of_body(float reflectance, float leaves, float g);

/// Part of diffuse light entering by `boundary`, which refracts, that a deep medium returns through it.
double refracted_body_reflectance(const CoatDescription& boundary, double albedo, double g);
/// The albedo of a walk in place of such a medium's.
float walk_albedo(const CoatDescription& boundary, float albedo, float g, float leaves);

}  // namespace lightmill
