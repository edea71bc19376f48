#pragma once
// What media emit, found by camera paths on their way.
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/walks/volume_way.h"

namespace lightmill {

/// Adds what medium `medium` emits, times the path's throughput and weight, to the paths in `mask`. `ratios`:
/// of the other strategies.
void add_glow(int depth, LaneInt slot, LaneMask mask, LaneInt medium, Vec3<Lane> glow, Lane mis,
              FamilyRatios ratios, const StageContext& context, Wavefront& w);
/// The same of what was found in grids. Weights differ from point to point: what is recorded is their mean.
void add_grid_glow(int depth, LaneInt slot, LaneMask mask, LaneInt medium, const VolumeWay<Lane>& found,
                   Lane dvc, const StageContext& context, Wavefront& w);
/// Says what the emission that is met on `way` competes with.
void compete(const StageContext& context, int depth, LaneMask varies, const PathLanes<Lane>& path,
             VolumeWay<Lane>* way);

}  // namespace lightmill
