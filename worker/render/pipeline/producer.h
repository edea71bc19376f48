#pragma once
// Stage 1: starts subpaths. Camera subpaths for every pixel of the cell in the crop window, and the layer's
// light subpaths.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Fills wavefront.paths with camera rays (throughput 1, M2).
void produce_camera_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront);
/// Fills wavefront.paths with light rays (M1) and queues the emitters themselves, joined to the camera (s = t
/// = 1).
void produce_light_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront);

}  // namespace lightmill
