#pragma once
// Light paths of a superblock are one net over the whole film, of which every packet has a part.
//
// A pixel has splats from light paths of all packets: were each packet's a net of its own, there would be as
// many in a pixel as chance brings, however many there are. Of one net the numbers are even, where a path's
// first few random numbers say where it ends; and a packet's own paths, whose vertices its camera vertices
// are joined to, are a net as before, as they follow one another in it.
#include "common/job/light_path_count.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives `layer` the names of the light paths of cell number `cell` and superblock `batch`.
inline void set_light_path_sampling(const StageContext& context, uint64_t cell, uint64_t batch, LayerContext* layer) {
  layer->packet_index = static_cast<uint32_t>(cell) * static_cast<uint32_t>(kSuperblockSamples);
  if (context.pixel_subset.one_in > 1) {
    // What starts with few pixels of each cell has few numbers of its part of the net, the same in all cells:
    // together they would be small corners of its coarse squares. Each cell has a net of its own.
    layer->light_key = stream_key(context.seed, kLightStream, cell, batch);
    layer->first_index = 0;
    return;
  }
  // The cells at the edge of the film have fewer.
  const auto per_cell = static_cast<uint64_t>(light_paths_of_layer(context.light_paths, kCellPixels));
  const uint64_t first = cell * kSuperblockSamples * per_cell;
  layer->light_key = stream_key(context.seed, kLightStream, first >> 32, batch);
  layer->first_index = static_cast<uint32_t>(first);
}

}  // namespace lightmill
