#pragma once
// Finds the medium that each light stands in, by the camera paths that reach it.
//
// A path carries the medium that it is in. So camera paths, next-event estimation included, never ask for a
// light's MediumInterface. Paths that start at lights must. Scene files that were only ever rendered from the
// camera often leave it out, and the two kinds of path would disagree. So a few camera paths are followed
// first. Where the medium that they have at a light differs from the scene file's, light paths start in
// theirs.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Corrects scene->lights.media and warns, at `where`, of what was corrected. Does nothing in a scene without
/// media. A function of the scene and the film's resolution alone.
void find_light_media(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width,
                      int height, const SourceLocation& where, RenderScene* scene);

}  // namespace lightmill
