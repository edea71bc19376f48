#pragma once
// What all stages read: the scene, the fixed settings of a render, and the layer of the packet at hand.
#include "common/job/packet_grid.h"
#include "common/job/pixel_interleave.h"
#include "common/job/sampling_plan.h"
#include "common/job/strategies.h"
#include "worker/render/accel/accel.h"
#include "worker/render/camera/camera.h"
#include "worker/render/camera/film_response.h"
#include "worker/render/camera/pixel_filter.h"
#include "worker/render/pipeline/camera_pass.h"
#include "worker/render/pipeline/kernel_set.h"
#include "worker/render/pipeline/work_items.h"
#include "worker/render/sampling/dimensions.h"
#include "worker/render/sampling/sobol.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

struct StageContext {
  const RenderScene& scene;
  const Accel& accel;
  const Camera& camera;
  const PixelFilter& filter;
  FilmGrid grid;
  const LightTable& lights = scene.lights;  // the scene's, or its guided ones
  uint64_t seed = 0;
  int max_depth = 5, rr_depth = kLeastRrDepth;  // SamplingPlan::rr_depth
  Strategies strategies = kAllStrategies;
  StageKernels kernels = {};  // the least that the scene can do with (kernel_choice.h)
  float splat_scale = 1;      // of one light path: 1 / light paths per unit of spp
  /// Samples of strategies of light paths for each of a camera path (n_j of mis.h): light paths of the whole
  /// film for t = 1; those that a camera vertex is connected to for s, t >= 2.
  float light_samples = 1, connections = 1;
  /// Sample allocation, if it is not uniform. MIS weights ignore it. If they went by its numbers, a region of
  /// few camera samples would leave its smooth light to splats, which are not stratified for it as camera
  /// samples are. So the variance of camera samples goes with 1 / the allocation, and splats are as
  /// everywhere.
  const AllocationTable* allocation = nullptr;
  double light_paths = 1;         // per camera path
  PixelSubset pixel_subset = {};  // of a pilot; renders have every pixel
  /// Where the pixels of a cell lie. Null: beside each other, as pilots and preview passes take them.
  const PixelInterleave* interleave = nullptr;
  float imaging_ratio = 1;                 // exposure: multiplies every contribution
  float light_factor = 1;                  // 2^k of normalised_light.h: of what leaves the pipeline
  const FilmResponse* response = nullptr;  // of the sensor; null: that of the plain film
  bool signed_film = false;                // sums may be negative: of a filter's lobes or a sensor's colours
  float tiny_contribution = 0;             // connections below this play Russian roulette; 0: never

  bool on(Strategies family) const { return strategies & family; }
  /// n_j of mis.h, except for light tracing. 0 for a family that is off.
  float samples_of(Strategies family) const {
    return !on(family) ? 0 : family == kVertexConnections ? connections : 1;
  }
  /// Light tracing alone can follow paths of any length: nothing is stored.
  bool lens_alone() const { return strategies == kLightTracing; }
};

/// One sample index of a packet: it identifies its random numbers.
struct LayerContext {
  uint32_t sample_in_superblock = 0;
  const CameraSlots* slots = nullptr;          // of the camera paths
  uint32_t light_key = 0;                      // of the light paths of a superblock: light_path_sampling.h
  uint32_t packet_index = 0, first_index = 0;  // among packets and paths of that key
  int light_paths = 0;                         // of this layer
  int first_light_path = 0;  // the one in slot 0: a wavefront holds kWavefront of them at a time
  float time = 0;            // of all paths, if they have none of their own (path_times.h)

  /// The streams of random numbers of path slots `slot`.
  template <class F>
  SampleStream<F> camera_stream(IntOf<F> slot) const {
    return {as_uint(gather(reinterpret_cast<const int32_t*>(slots->keys), slot)),
            as_uint(gather(reinterpret_cast<const int32_t*>(slots->index), slot))};
  }
  template <class F>
  SampleStream<F> light_stream(IntOf<F> slot) const {
    return {splat_uint<F>(light_key),
            as_uint(slot) + (first_index + sample_in_superblock * static_cast<uint32_t>(light_paths) +
                             static_cast<uint32_t>(first_light_path))};
  }
};

}  // namespace lightmill
