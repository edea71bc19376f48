#pragma once
// Stage 1: starts camera and light subpaths for every pixel of the cell that lies in the crop window.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Fills wavefront.paths with camera rays (throughput 1, M2).
void produce_camera_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront);
/// Fills wavefront.paths with light rays (M1) and queues the emitters' own lens connections (s = t = 1).
void produce_light_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront);

}  // namespace lightmill
