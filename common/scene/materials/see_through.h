#pragma once
// Transparent BSDFs: what rays pass without meeting it.
#include "common/scene/description.h"

namespace lightmill {

class ProblemList;

/// Gives each material of `scene` that is transparent in part the share of rays that it stops
/// (MaterialDescription::opacity), and its shapes that share as an alpha mask. So next-event estimation sees
/// through it, and a path has no vertex where it passes. With a colour they are panes instead (pane.h): it
/// has one, that of the first such BSDF among its parts. `problems` is told what is lost. Mixes must not
/// contain themselves.
void cut_out_transparent(SceneDescription* scene, ProblemList* problems);

}  // namespace lightmill
