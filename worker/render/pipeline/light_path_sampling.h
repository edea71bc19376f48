#pragma once
// The random numbers of light paths. Those of a superblock are one low-discrepancy net over the whole film,
// of which every packet has a part; the superblocks of a replicate follow one another in one sequence.
//
// A pixel gets splats from the light paths of all packets. With a net of its own for each packet, their
// number in a pixel would be left to chance, however many there are. With one net the numbers are even
// wherever a path's first few random numbers say where it ends. A packet's own paths, whose vertices its
// camera vertices are joined to, follow one another in the net, so they are a net by themselves, too.
//
// From superblock to superblock the film's paths get more even. A packet's own do not: its indices lie apart,
// and between them the shuffle (sobol.h) is as good as random.
#include <bit>

#include "common/job/light_path_count.h"
#include "common/job/replicates.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Sets the numbers of `layer`'s light paths, for a cell and a superblock.
inline void set_light_path_sampling(const StageContext& context, int cell_x, int cell_y, int64_t superblock,
                                    LayerContext* layer) {
  constexpr auto kSamples = static_cast<uint64_t>(kSuperblockSamples);
  const auto cells = [](int pixels) { return (static_cast<uint64_t>(pixels) + kCellSize - 1) / kCellSize; };
  const uint64_t columns = cells(context.grid.width), count = columns * cells(context.grid.height);
  const uint64_t cell = static_cast<uint64_t>(cell_y) * columns + static_cast<uint64_t>(cell_x);
  if (context.pixel_subset.one_in > 1) {
    // With few pixels of each cell, the paths have few numbers of the cell's part of the net, the same in all
    // cells: together they would be small corners of its coarse squares. So each cell has a net of its own.
    layer->light_key = stream_key(context.seed, kLightStream, cell, static_cast<uint64_t>(superblock));
    layer->packet_index = static_cast<uint32_t>(cell * kSamples);
    layer->first_index = 0;
    return;
  }
  const ReplicateBlock block = replicate_of(superblock);
  const auto k = static_cast<uint64_t>(block.superblock);
  const uint64_t parts = std::bit_ceil(count);
  const uint64_t part = k * parts + cell;
  // Cells at the edge of the film have fewer paths than their part has room for.
  const uint64_t room =
      std::bit_ceil(kSamples * static_cast<uint64_t>(light_paths_of_layer(context.light_paths, kCellPixels)));
  const uint64_t first = part * room;
  layer->light_key =
      stream_key(context.seed, kLightStream, first >> 32, static_cast<uint64_t>(block.replicate));
  layer->first_index = static_cast<uint32_t>(first);
  layer->packet_index = static_cast<uint32_t>(part * kSamples);
}

}  // namespace lightmill
