#pragma once
// Turns described lights that are not shapes into records of the light table. Everything that rounds happens
// once, in double.
#include <string>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// "file:line:column: ", the start of a message.
std::string place(const SourceLocation& where);

/// Adds the light unless it is dark. The scene's bounds must be known. Throws Error(kBadScene), with its
/// place, for a light that cannot shine and for images that can't be read.
void add_light(const LightDescription& light, RenderScene* scene);

}  // namespace lightmill
