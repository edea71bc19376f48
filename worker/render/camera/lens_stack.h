#pragma once
// A system of lenses made ready for tracing: focused, with its stop and its exit pupil.
#include <vector>

#include "common/scene/description.h"
#include "worker/render/camera/lens_trace.h"

namespace lightmill {

/// Rectangle of the rear plane that holds every point through which film points at one distance from the axis
/// see the scene; turned so that they lie on +x. Empty: they see nothing.
struct PupilBounds {
  float x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  float area() const { return (x1 - x0) * (y1 - y0); }
};
/// Distances from the axis that bounds are kept for.
inline constexpr int kPupils = 64;

/// Focuses by thick lens approximation: Gaussian optics of the whole system. Throws Error(kBadScene) if
/// nothing at the focus distance can be sharp, or an aperture image can't be read.
LensStack build_lenses(const LensSystem& system);

/// By tracing a grid of rays from film points; kPupils of them over half the film's diagonal (m).
std::vector<PupilBounds> exit_pupils(const LensStack& lenses, double half_diagonal);

}  // namespace lightmill
