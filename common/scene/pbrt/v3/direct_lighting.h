#pragma once
// pbrt-v3's integrators "directlighting" and "whitted": direct light, and paths through mirrors and clear
// glass.
#include <string>

#include "common/scene/problem_list.h"

namespace lightmill::v3 {

bool is_direct_lighting(const std::string& integrator);

/// The depth of path tracing that stands for them: 1, as by pbrt-v4's --upgrade, unless a surface in use is
/// specular, which would be black then: the depth of the file. Says so at `where`.
void choose_depth(const SourceLocation& where, SceneDescription* scene, ProblemList* problems);

}  // namespace lightmill::v3
