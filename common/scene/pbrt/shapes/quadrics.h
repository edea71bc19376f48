#pragma once
// Shapes of a pbrt scene that are not meshes: spheres, disks, cylinders, bilinear patches.
#include <optional>

#include "common/scene/pbrt/scene.h"

namespace lightmill {

/// A shape and how many emitters pbrt would count it as (AreaLightSource's "power" is per emitter).
struct ReadShape {
  ShapeKind kind;
  size_t emitters = 1;
};

/// nullopt: reported. What is not a whole sphere becomes a mesh; see tessellate.h for how near it is.
std::optional<ReadShape> read_sphere(PbrtScene& out, ParameterList& params);
std::optional<ReadShape> read_disk(PbrtScene& out, ParameterList& params);
std::optional<ReadShape> read_cylinder(PbrtScene& out, ParameterList& params);
std::optional<ReadShape> read_bilinear_mesh(PbrtScene& out, ParameterList& params);

/// Replaces spheres whose transform (their own, or that of an instance of their object) stretches them, and
/// those with an alpha mask, by meshes of kSphereSegments, and those that emit and move by coarser ones; if
/// there are more than about 120, of fewer, so that the memory lasts, and with a warning from about 2000 on.
void tessellate_spheres(SceneDescription* scene, ProblemList* problems);

}  // namespace lightmill
