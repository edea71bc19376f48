#pragma once
// Scenes with objects and instances, and the same scenes without.
#include <functional>

#include "common/scene/transform.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {

/// A sphere of `segments`^2 / 2 triangles or more with normals and texture coordinates.
std::shared_ptr<const TriangleMesh> ball_mesh(double radius, int segments);
/// Starts an object; `add_to_object` and `instance` take its index.
int begin_object(TestScene* s, const std::string& name);
ShapeDescription& add_to_object(TestScene* s, int object, ShapeKind kind, int material,
                                const Transform& to_object = {});
void instance(TestScene* s, int object, const Transform& to_world);

/// The scene with the shapes of its instances written out.
SceneDescription flattened(const SceneDescription& scene);

/// Index of one more end of a way, for `moves_to`.
int ends_at(TestScene* s, const Transform& end);
/// A mesh whose vertices are at bend(p, s) at the fraction s of the exposure, in `steps` straight parts. Its
/// normals go along.
std::shared_ptr<const TriangleMesh> bending(const TriangleMesh& mesh, size_t steps,
                                            const std::function<Vec3f(const Vec3f&, double)>& bend);
/// The scene as it is at `time`, 0 and 1 being the ends of its ways: nothing moves.
SceneDescription still_at(const SceneDescription& scene, double time);

/// The room of cornell_room with three objects that share their geometry: bumpy, masked and mirrored ones.
TestScene room_of_instances();

}  // namespace lightmill::test
