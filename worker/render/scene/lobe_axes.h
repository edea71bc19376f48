#pragma once
// Which way anisotropic lobes lie at a surface point.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/angle.h"
#include "worker/render/scene/surface.h"

namespace lightmill {

/// Sets the rotation of anisotropic lanes: from the first axis of Frame(ns) to dp/du, in turns.
template <class F>
inline void orient_lobes(const Surface<F>& surface, const Vec3<F>& ns, IntOf<F> kind, BsdfParams<F>* params) {
  const MaskOf<F> lies = anisotropic<F>(kind);
  if (!any(lies)) return;
  const Frame<F> frame(ns);
  const Vec3<F> tangent = frame.to_local(unit_tangent(surface.dpdu, ns));
  params->p[9] = select(lies, turns(tangent.y, tangent.x), params->p[9]);
}

}  // namespace lightmill
