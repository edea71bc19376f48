#pragma once
// Records what every strategy did in the packets of one thread, for diagnosis and pilots. A wavefront without
// a recorder pays one test of a pointer per batch.
#include <array>
#include <cstdint>
#include <vector>

#include "common/job/strategies.h"
#include "worker/render/pipeline/paths/roulette.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// Strategies are told apart up to this many vertices a side. Longer ones count with it.
inline constexpr int kRecordedVertices = 12;

/// The parts of a path's density under all strategies that stem from each family; their sum is 1. A set S of
/// families would give the same contribution the weight (its own family's share) / (the shares in S). Its
/// second moment is the sum over contributions of value^2 / (the shares in S): Grittmann et al. 2022, eq. 12.
struct FamilyShares {
  float hit = 0, next_event = 0, lens = 0, connect = 0;
  float of(Strategies set) const {
    return (set & kEmissionHits ? hit : 0) + (set & kNextEvent ? next_event : 0) +
           (set & kLightTracing ? lens : 0) + (set & kVertexConnections ? connect : 0);
  }
};

/// The same per lane before normalisation: ratios of densities to the strategy at hand, whose own is 1.
using FamilyRatios = std::array<FamilyShares, kLanes>;
inline void add_ratio(FamilyRatios* ratios, float FamilyShares::*family, Lane x) {
  for (int l = 0; l < kLanes; ++l) (*ratios)[static_cast<size_t>(l)].*family += lane(x, l);
}

/// Shares of the photon guide that are compared; 0: no guide.
inline constexpr std::array<float, 4> kGuideShares{0, 0.1f, 0.25f, 0.5f};
/// The density of a camera subpath under each of these shares, over that under the guide's own share.
using GuideOdds = std::array<float, kGuideShares.size()>;
inline constexpr GuideOdds kEvenOdds{1, 1, 1, 1};

/// A contribution that reached the film.
struct StrategyContribution {
  int32_t s = 0, t = 0;      // vertices of the light and of the camera subpath
  int32_t slot = 0;          // of the camera path within the cell; of splats of the light path
  int32_t light_slot = -1;   // of the light path within its wavefront, if there is one
  uint32_t pixel = 0;        // row-major in the full frame; of a splat draw_splat's
  float rgb[3] = {0, 0, 0};  // weighted, on the scale of a pixel sample
  float weight = 0;          // MIS weight within rgb
  float size = kNoRoulette;  // what roulette judged it by (connection_survival)
  FamilyShares shares;
};

/// A vertex of a path, in normalised space.
struct PathVertex {
  int32_t slot = 0;
  bool light = false;  // which subpath
  int32_t depth = 0;   // 1: the first surface hit
  int32_t primitive = 0;
  float p[3] = {0, 0, 0};
  float throughput[3] = {0, 0, 0};
};

/// How a light path set out.
struct PathStart {
  int32_t light = 0;
  float direction[3] = {0, 0, 0};
};

/// Counts of one (s,t). evaluated = zero + rouletted + occluded + visible.
struct StrategyCounts {
  uint64_t evaluated = 0, zero = 0, rouletted = 0, occluded = 0, visible = 0;
  double cpu_seconds = 0;  // while `timed`
};

class StrategyRecorder {
 public:
  using Table = std::array<std::array<StrategyCounts, kRecordedVertices + 1>, kRecordedVertices + 1>;

  std::vector<StrategyContribution> contributions;  // since the last clear()
  std::vector<PathVertex> vertices;                 // the same, while `trace`
  bool trace = false;
  bool timed = false;  // whether CPU times are taken: two system calls a stage, which pilots have no use for
  std::vector<GuideOdds> odds;  // of the contributions, while `weigh_guide`
  bool weigh_guide = false;
  Table counts{};                                                // [s][t]
  std::array<PathStart, kWavefront> light_starts{};              // of the last light paths, by slot
  double light_subpath_seconds = 0, camera_subpath_seconds = 0;  // while `timed`
  // Surfaces that paths met, and steps of their walks through bodies: of camera paths by slot.
  std::array<uint32_t, kWavefront> hits_of_path{}, steps_of_path{};
  /// Of camera paths, by slot: the probability to survive event kLeastRrDepth, if that plays no roulette.
  /// Else 1, and for paths that end before.
  std::array<float, kWavefront> survival_of_path{};
  /// Hits of camera paths after that event, times 1 - survival: what roulette there would save.
  double hits_to_save = 0;
  uint64_t light_hits = 0, light_steps = 0;
  uint64_t inconsistent_hits = 0;  // ended where shading and geometric normal disagree on the side

  void begin_layer(const CameraSlots& slots, int film_width) { slots_ = &slots, width_ = film_width; }
  void clear() { contributions.clear(), vertices.clear(), odds.clear(); }

  /// Names the lanes of the next call that queues candidates.
  void announce(LaneInt s, int t, LaneInt slot, LaneInt light_slot, Lane weight, const FamilyRatios& ratios);
  /// For the announced lanes: which were evaluated, and of those which were zero or lost at roulette.
  void candidates(unsigned evaluated, unsigned zero, unsigned rouletted);
  /// Announced lane `l` became entry `i` of the shadow rays. `size`: what roulette judged it by.
  void queued(int l, int i, float size);
  /// The queue was tested; `seconds` are divided among its entries. With media, what was announced lacks P~
  /// of the segments (medium_walk.h).
  void resolved(const StageContext& context, const ShadowRays& rays, bool splats, double seconds,
                const MediaWork* media);
  /// Camera paths in `mask` hit an emitter or escaped after t - 1 segments.
  void emission(int t, LaneInt slot, LaneMask mask, const Vec3<Lane>& rgb, Lane weight,
                const FamilyRatios& ratios);
  void vertex(bool light, int depth, LaneInt slot, LaneMask mask, LaneInt primitive, const Vec3<Lane>& p,
              const Vec3<Lane>& throughput);
  // Parts of dVC along the subpaths (mis.h): what light tracing adds on a camera path; what next event and
  // emission hits add on a light path. The rest is vertex connections. Slots and vertices as in the
  // wavefront.
  void start_camera_paths() {
    camera_.fill({});
    survival_of_path.fill(1);
    if (weigh_guide) odds_.fill(kEvenOdds), vertex_odds_.fill(kEvenOdds);
  }
  void start_light_paths(int base, Lane dvc, LaneInt light, const Vec3<Lane>& direction);
  /// M3: all parts are divided by the cosine.
  void hit(bool light, LaneInt slot, LaneMask mask, Lane inv_cos);
  /// Paths in these slots take a step through a body.
  void walk_steps(bool light, const std::vector<int32_t>& slots);
  /// M4, M5: parts are scaled by `gain`. At depth 1 `dvcm_term` is the family's own.
  void scatter(bool light, int depth, LaneInt slot, LaneMask mask, Lane gain, Lane dvcm_term);
  /// Camera paths come through event kLeastRrDepth. `survival`: of survival_of_path.
  void roulette(LaneInt slot, LaneMask mask, Lane survival);
  /// Camera paths leave their vertices. `odds` per lane.
  void scatter_by_guide(LaneInt slot, LaneMask mask, const std::array<GuideOdds, kLanes>& odds);
  /// Vertices first, first + 1, ... are those in `mask`.
  void store(bool light, size_t first, LaneInt slot, LaneMask mask);
  /// Adds to `ratios` the families of dVCM + dVC * pdf_reverse, times `scale`, of stored vertices.
  void add_stored(bool light, LaneInt index, LaneInt depth, Lane scale, Lane dvcm, Lane dvc, Lane pdf_reverse,
                  FamilyRatios* ratios) const;
  /// Adds those of dVC * scale of camera paths that end on an emitter.
  void add_camera_path(LaneInt slot, Lane scale, Lane dvc, FamilyRatios* ratios) const;

  /// Between these two calls a stage forms candidates. Its `seconds` are divided among those evaluated,
  /// without what resolved() took meanwhile.
  void begin_stage() { before_ = counts, resolving_seconds_ = 0; }
  void end_stage(double seconds);

 private:
  struct Announced {
    int32_t s = 0, t = 0, slot = 0, light_slot = -1;
    float weight = 0, size = kNoRoulette;
    FamilyShares shares;
  };
  /// The parts of dVC that connections do not add.
  struct Parts {
    float next_event = 0, hit = 0;  // light paths
    float lens = 0;                 // camera paths
  };
  uint32_t pixel_of(int32_t slot) const;

  const CameraSlots* slots_ = nullptr;  // of the wavefront
  int width_ = 0;
  std::array<Announced, kLanes> announced_{};
  std::array<Announced, ShadowRays::kCapacity> pending_{};
  std::array<Parts, kWavefront> camera_{}, light_{};
  std::vector<Parts> camera_vertices_, light_vertices_;
  std::array<GuideOdds, kWavefront> odds_{},
      vertex_odds_{};             // of camera paths; of what leads to their vertices
  Table before_{};                // counts at begin_stage()
  double resolving_seconds_ = 0;  // since then
};

}  // namespace lightmill
