#pragma once
// Which media lights stand in, by the paths that reach them.
//
// A path carries the medium that it is in, so that camera paths, next event included, never ask what a
// light's MediumInterface says; paths that start at lights must. Scene files that were only ever rendered
// from the camera often say nothing there, and both kinds of path would disagree. So a few camera paths find
// out first what they meet at the lights, and where that differs from the scene file, it is what light paths
// start in.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Mends scene->lights.media and warns, at `where`, of what was mended. Does nothing in a scene without
/// media. A function of the scene and the film's resolution alone.
void find_light_media(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width,
                      int height, const SourceLocation& where, RenderScene* scene);

}  // namespace lightmill
