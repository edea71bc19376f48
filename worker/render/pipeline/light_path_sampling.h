#pragma once
// The random numbers of light paths: those of a superblock are one low-discrepancy net over the whole film,
// and every packet has a part of it.
//
// A pixel gets splats from the light paths of all packets. With a net of its own for each packet, their
// number in a pixel would be left to chance, however many there are. With one net the numbers are even
// wherever a path's first few random numbers say where it ends. A packet's own paths, whose vertices its
// camera vertices are joined to, follow one another in the net, so they are a net by themselves, too.
#include "common/job/light_path_count.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Sets the numbers of `layer`'s light paths, for cell number `cell` and superblock `batch`.
inline void set_light_path_sampling(const StageContext& context, uint64_t cell, uint64_t batch,
                                    LayerContext* layer) {
  layer->packet_index = static_cast<uint32_t>(cell) * static_cast<uint32_t>(kSuperblockSamples);
  if (context.pixel_subset.one_in > 1) {
    // With few pixels of each cell, the paths have few numbers of the cell's part of the net, the same in all
    // cells: together they would be small corners of its coarse squares. So each cell has a net of its own.
    layer->light_key = stream_key(context.seed, kLightStream, cell, batch);
    layer->first_index = 0;
    return;
  }
  // Cells at the edge of the film have fewer.
  const auto per_cell = static_cast<uint64_t>(light_paths_of_layer(context.light_paths, kCellPixels));
  const uint64_t first = cell * kSuperblockSamples * per_cell;
  layer->light_key = stream_key(context.seed, kLightStream, first >> 32, batch);
  layer->first_index = static_cast<uint32_t>(first);
}

}  // namespace lightmill
