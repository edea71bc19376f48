#pragma once
// glTF 2.0 scenes, .gltf and .glb.
//
// Where the format says nothing: the resolution is 1280 pixels on the longer side in the camera's aspect
// ratio (16:9 without one), paths have no depth limit, nothing is exposed: a pixel is the radiance in nits.
// Surfaces reflect on both sides; only emission heeds doubleSided.
#include "common/scene/load.h"
#include "common/scene/problem_list.h"

namespace lightmill {

/// Reads the file `name`. The scene is complete if no error was reported.
SceneDescription read_gltf(const std::string& name, const FileSource& files, const LoadOptions& options,
                           ProblemList* problems);

}  // namespace lightmill
