#pragma once
// Follows rays from points in given directions through mirrors and smooth glass by given events. Nothing is
// drawn.
#include <array>

#include "worker/render/guiding/photon.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Where chains begin: a point per lane, with kChains of them from each.
struct ChainStart {
  Vec3<Lane> p, ng;
  Lane error{}, time{};
  LaneInt events{};  // SpecularEvents
};
inline constexpr int kChains = 3;

struct ChainEnd {
  LaneMask reached = splat_mask<Lane>(false);  // all events happened as given
  Vec3<Lane> origin, direction;                // the ray that leaves the last of them
  Vec3<Lane> throughput;                       // of radiance against the ray's direction
  UintOf<Lane> trace{};  // equal for chains that met the same primitives; else nearly always different
};

/// Follows one chain per direction from each of the `active` lanes. `w` is a wavefront for nothing else,
/// whose first kChains kLanes paths are overwritten. `counters` are the render's.
std::array<ChainEnd, kChains> follow_chains(const StageContext& context, const ChainStart& start,
                                            LaneMask active,
                                            const std::array<Vec3<Lane>, kChains>& directions, Wavefront& w,
                                            RenderCounters* counters);

}  // namespace lightmill
