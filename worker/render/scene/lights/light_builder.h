#pragma once
// Turns described lights that are not shapes into records of the light table. Everything that rounds happens
// once, in double.
#include <string>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// "file:line:column: ", the start of a message.
std::string place(const SourceLocation& where);

/// Adds the light; nothing if it is dark. The scene's bounds must be known. Throws
/// Error(kBadScene) for what cannot shine and images that can't be read, with its place.
void add_light(const LightDescription& light, RenderScene* scene);

}  // namespace lightmill
