#pragma once
// Stage 5: adds unoccluded contributions to the packet's paths and splats, and finished paths to its sums.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Adds queued contributions that are not occluded to the paths' radiance.
void film_add_to_paths(Wavefront& wavefront);
/// Appends queued contributions that are not occluded to the packet's splats.
void film_add_splats(const StageContext& context, Wavefront& wavefront);
/// Rounds what the sensor makes of the weighted radiance of every camera path of the pass to the quantum and
/// adds it to the cell's sums; radiance and weights become the sensor's. A value that is not finite, or that
/// is negative where the film's can't be, is dropped and counted.
void film_finish_pass(const StageContext& context, int quantum_exponent, Wavefront& wavefront);

}  // namespace lightmill
