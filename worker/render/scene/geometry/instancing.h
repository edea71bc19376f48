#pragma once
// Which objects are built once and instanced, and which are copied into the world ("flattened").
//
// Flattened is what must be: shapes that emit (each of their triangles is a light with its own place), and
// instances whose matrix is too near to singular for float rays. Flattened is also what is cheaper so:
// objects used once, and small ones, as long as all their copies together are few.
//
// Shapes that emit and move have an object for each of their places: each of its triangles is one light.
//
// What moves is an instance, too: shapes that move together are an object of their own. So are those that
// bend, as if they moved, be it nowhere.
#include <deque>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Small objects have up to this many primitives. Flattening those of 12 to 50 makes rays 1.1 to 1.6 times as
/// fast, of 200 still 1.0 to 1.2 times; with 2000 it gains nothing.
inline constexpr size_t kSmallObject = 64;
/// The copies of all small objects may have this many primitives together: about 10 MB, and at most 64 MB for
/// the structures of as many shapes.
inline constexpr size_t kFlattenedPrimitives = 65536;

/// An object that is built once. Its space: p -> (p - center) 2^exponent, which brings its box to a size of
/// 1.
struct InstancedObject {
  std::vector<const ShapeDescription*> shapes;
  Vec3d center;
  int exponent = 0;
  double lo[3], hi[3];  // its box, before that
};
struct PlacedObject {
  size_t object = 0;  // index into SplitScene::objects
  const Transform* object_to_world = nullptr;
  int32_t way = -1;  // index into SplitScene::ways of one that moves; `object_to_world` is its first
  RayKinds hidden = 0;
  PartNames names = {};
};
struct SplitScene {
  std::vector<InstancedObject> objects;
  std::vector<PlacedObject> instances;  // those that move last
  /// Transforms at even times. Between them entries change linearly (instance_pose.h).
  std::vector<std::vector<Transform>> ways;
  std::deque<ShapeDescription> moving;  // shapes that move, in the space of their object
  /// Shapes that can't move along, as their transforms are nearly singular on the way: they stay at rest.
  std::vector<const ShapeDescription*> stopped;
  std::vector<ShapeDescription> flattened;  // in the world
  size_t flattened_instances = 0;           // that have something in `flattened`
};

/// A mesh that bends while the shutter is open.
bool bends(const ShapeDescription& shape);
/// Whether a shape of its own, beside what its object does, is not all the time as it is at first. Spheres
/// that emit stand still.
bool changes(const ShapeDescription& shape);

/// The result has pointers into `scene`. Throws Error(kBadScene) if too much must be flattened.
SplitScene split_instances(const SceneDescription& scene);

/// The power of two that brings the entries of a transform to about 1.
int record_exponent(const Transform& object_to_world);
/// Writes the record (kInstanceFloats, placement.h) of an object at `object_to_world`, whose entries
/// 2^exponent brings to about 1. `position`: its center in normalised space, which is the scene's scaled by
/// 2^scene_exponent. Returns false if it is so small that nothing can hit it.
bool instance_record(const InstancedObject& object, const Transform& object_to_world, int exponent,
                     const Vec3d& position, int scene_exponent, float* record);

/// What rays' way into each object's space rounds away there, beside what is rounded in it
/// (Placement::error), for the worst of its instances. `origin`: of normalised space, in the scene.
std::vector<double> rounding_of_instances(const SplitScene& split, const Vec3d& origin);

}  // namespace lightmill
