#pragma once
// Rays that leave points in given directions and are followed through mirrors and smooth glass by given
// events, without anything being drawn.
#include <array>

#include "worker/render/guiding/photon.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Where chains begin, a point per lane; kChains of them from each.
struct ChainStart {
  Vec3<Lane> p, ng;
  Lane error{}, time{};
  LaneInt events{};  // SpecularEvents
};
inline constexpr int kChains = 3;

struct ChainEnd {
  LaneMask reached = splat_mask<Lane>(false);  // all events happened as they were to
  Vec3<Lane> origin, direction;                // the ray that leaves the last of them
  Vec3<Lane> throughput;                       // of radiance that comes against it
  UintOf<Lane> trace{};  // the same for chains that met the same primitives, as good as always
};

/// Follows from each of the `active` lanes one chain per direction. `w` is a wavefront for nothing else,
/// whose first kChains kLanes paths are overwritten; `counters` are the render's.
std::array<ChainEnd, kChains> follow_chains(const StageContext& context, const ChainStart& start,
                                            LaneMask active,
                                            const std::array<Vec3<Lane>, kChains>& directions, Wavefront& w,
                                            RenderCounters* counters);

}  // namespace lightmill
