#pragma once
// pbrt's curves: hair, fur and grass.
#include <memory>

#include "common/scene/pbrt/scene.h"

namespace lightmill {

/// One curve as a mesh; null if it was refused (reported) or has no length (warned of, once a scene).
std::shared_ptr<TriangleMesh> read_curve(PbrtScene& out, ParameterList& params);
/// Adds the curve's mesh to the shape before it if that is of curves too and differs in nothing else, so that
/// a head of hair becomes a few meshes. False: it needs a shape of its own.
bool join_curves(PbrtScene& out, const ShapeDescription& curve);

}  // namespace lightmill
