#pragma once
// Turns described lights into records of the light table. Everything that rounds happens once, in double.
#include <string>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// "file:line:column: ", the start of a message.
std::string place(const SourceLocation& where);

/// Adds a light that is not a shape; nothing if it is dark. The scene's bounds must be known. Throws
/// Error(kBadScene) for what cannot shine and Error(kFailed) for an image that can't be read, with its place.
void add_light(const LightDescription& light, RenderScene* scene);

/// What a shape's emission depends on besides its geometry.
struct EmitterSource {
  const AreaLightDescription& light;
  FloatInput alpha;
};

/// Adds the triangle of vertices i[3] as an emitter; returns its index in scene->lights, or -1 if it is dark.
/// `winding` is its unit normal, `area` its area, `flags` the primitive's.
int32_t add_triangle_emitter(const EmitterSource& source, const int32_t* i, const Vec3d& winding, double area,
                             int32_t flags, RenderScene* scene);
/// The same for the last sphere of scene->spheres.
int32_t add_sphere_emitter(const EmitterSource& source, bool reverse_orientation, RenderScene* scene);

}  // namespace lightmill
