#pragma once
// Stage 5: adds unoccluded contributions to the packet's paths and splats, and finished paths to its sums.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Adds queued contributions that are not occluded to the paths' radiance.
void film_add_to_paths(Wavefront& wavefront);
/// Appends queued contributions that are not occluded to the packet's splats.
void film_add_splats(const StageContext& context, Wavefront& wavefront);
/// Applies the sensor's response to the weighted radiance of every camera path of the pass, rounds it to the
/// quantum, and adds it to the cell's sums. Radiance and weights become the sensor's. Drops and counts
/// samples that the sums refuse, and counts what a limit or rounding takes away (common/film/dropped.h).
void film_finish_pass(const StageContext& context, int quantum_exponent, Wavefront& wavefront);

}  // namespace lightmill
