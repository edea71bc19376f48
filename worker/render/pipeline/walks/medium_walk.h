#pragma once
// Stage 2 where the scene has media: the caster with a walk through them. Scenes without media never come
// here.
//
// A segment goes from one vertex to the next, straight through boundaries of media, which are no events. The
// distance at which it ends in a medium is drawn once for the whole segment: a channel c in proportion to the
// path's throughput, w_c, and an optical depth of it. So a segment that ends at x has density
//   p(x) = sum_c w_c mu_c(x) P_c(x),   and P = sum_c w_c P_c(x) to get to a surface at x or beyond,
// with P_c(x) = exp(-integral of mu_c up to x) and mu the collision rate of medium.h. The throughput is
// multiplied by sigma_s,c T_c / p, or T_c / P, where T is the transmittance. The sum over the channels of
// what goes on never grows, however much their coefficients differ. One channel alone is what gets lost.
//
// MIS (mis.h) needs densities that do not depend on where the path came from. In their place its terms use
//   P~ = mean over the channels of P_c,   and mu~, the mean rate, at a vertex in a medium,
// a fixed function of the path of the true densities' size. Weights still sum to one.
//
// A medium without boundary, which the camera or a light stands in, ends at the sphere around the scene and
// the camera, so that light from infinity has a finite way through it. If there is no such light, it goes on
// without end, as far as light is worth it there (RenderScene::media_reach).
//
// Media that vary over a grid: volume_walk.h. There mu is a function of the place, and P_c has a factor for
// every null collision.
//
// Panes (materials/pane.h) are boundaries that a segment passes with the probability T of each. One number u
// is drawn for the whole segment, which ends at the first pane where the product of all T so far is not above
// u. The product is part of the P~ of the segment, and of the transmittance of a connection.
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/walks/volume_walk.h"

namespace lightmill {

/// In place of a primitive: the path ends in a medium.
inline constexpr int32_t kInMedium = -2;

struct MediaWork {
  // Of the segment that is walked, by path slot.
  alignas(32) float start[3][kWavefront];  // where it began
  alignas(32) float end[3][kWavefront];    // where in a medium it ended
  alignas(32) float before[kWavefront];    // the largest channel of the throughput at its start
  alignas(32) float depth[3][kWavefront];  // optical depth so far
  alignas(32) float rate[3][kWavefront];   // the same by the collision rate
  alignas(32) float left[kWavefront];      // until it ends, in the chosen channel
  alignas(32) int32_t channel[kWavefront];
  alignas(32) float pane_draw[kWavefront], panes[kWavefront];  // u, and the product of T so far
  alignas(32) float end_rate[kWavefront];  // mean collision rate where it ended in a medium
  alignas(32) float nulls[3][kWavefront];  // volume_walk.h; set where there are grids
  alignas(32) int32_t drawn[kWavefront];

  // Of the shadow rays in the queue: the medium that they start in, and w_light + w_camera without P~ of
  // their segment, which is known once they are traced. What is queued is weighted as if it were 1.
  alignas(32) int32_t shadow_medium[ShadowRays::kCapacity];
  alignas(32) float shadow_ratio[ShadowRays::kCapacity];
  alignas(32) int32_t shadow_volume[ShadowRays::kCapacity];  // the medium that they must end in, or 0
  // Set by trace_transmittance: P~, and optical depths while it runs.
  alignas(32) float passed[ShadowRays::kCapacity];
  alignas(32) float shadow_depth[3][ShadowRays::kCapacity], shadow_rate[3][ShadowRays::kCapacity];
  alignas(32) float shadow_panes[ShadowRays::kCapacity];  // product of their T
  // Where there are grids: seeds, and as above.
  alignas(32) int32_t shadow_seed[ShadowRays::kCapacity], shadow_drawn[ShadowRays::kCapacity];
  alignas(32) float shadow_nulls[3][ShadowRays::kCapacity], shadow_left[ShadowRays::kCapacity];
  uint8_t shadow_crossed[ShadowRays::kCapacity];  // whether boundaries may lie on their way
  TracedRay shadow_rays[ShadowRays::kCapacity];

  /// A shadow ray of next-event estimation that got to a light, and the medium that it was in there.
  struct Arrival {
    int32_t light;
    bool outside;  // of the light's surface
    int32_t medium;
  };
  std::vector<Arrival>* arrivals = nullptr;                 // not owned; null but in light_media.h
  alignas(32) int32_t shadow_light[ShadowRays::kCapacity];  // of next event: light * 2 + outside

  std::vector<int32_t> casting, walking;  // slots with a ray to cast; those that it is not done with
  VolumeWays ways;                        // of some of them, while they are walked
};

/// Casts all paths and walks on through boundaries, until each ends on a surface, ends in a medium (its
/// primitive is then kInMedium) or escapes. Multiplies throughputs, divides dVCM by P~ (M3), adds what media
/// emit. `depth`: of the vertices to come.
void cast_light_paths_through_media(const StageContext& context, const LayerContext& layer, int depth,
                                    Wavefront& w);
void cast_camera_paths_through_media(const StageContext& context, const LayerContext& layer, int depth,
                                     Wavefront& w);

/// Tests the queued shadow rays as Accel::occluded does, but through boundaries. Multiplies those that are
/// free by their transmittance and completes their MIS weights, which depend on it.
void trace_transmittance(const StageContext& context, RayKinds kinds, Wavefront& w);

}  // namespace lightmill
