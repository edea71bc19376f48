#pragma once
// Motion on the film while the shutter is open, for the AOV `motion`.
#include <array>

#include "worker/render/pipeline/context.h"

namespace lightmill {

struct Hit;  // path_vertex.h

/// How far what camera paths hit moves on the film from the shutter's opening to its closing, in pixels,
/// right and down: where the same point of the same thing is at time 1 less where it is at time 0, as the
/// camera sees it at these times (a thin lens through its middle). 0 if it is not before the camera at either
/// of them, and for a realistic camera, of which nobody knows where it shows a point. `time`: of the paths.
std::array<Lane, 2> motion_on_film(const StageContext& context, const Hit& hit, LaneMask active, Lane time);

}  // namespace lightmill
