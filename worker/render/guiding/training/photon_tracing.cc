#include "worker/render/guiding/training/photon_tracing.h"

#include <array>
#include <cmath>
#include <memory>

#include "worker/render/guiding/manifold_targets.h"
#include "worker/render/guiding/photon_guide.h"
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/producer.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {
namespace {

constexpr uint64_t kPhotonSeed = 0x63617573;

/// What the light paths of a wavefront do at mirrors and glass, from the light on.
class EventLog {
  static_assert(kPhotonDepth <= SpecularEvents::kMost);

 public:
  /// Paths are about to leave their lights.
  void start(const Paths& paths) {
    for (int i = 0; i < paths.active_count; ++i) {
      const auto slot = static_cast<size_t>(paths.active[i]);
      light[slot] = std::bit_cast<int32_t>(paths.carried[slot][Paths::kLight]);
      emitted[slot] = direction_of(paths, slot);
      const float* o = paths.rays[slot].origin;
      from[slot] = {o[0], o[1], o[2]};
    }
  }
  /// Paths have come to their hits.
  void meet(const StageContext& context, const Paths& paths) {
    for (int base = 0; base < paths.active_count; base += kLanes) {
      const Group g(paths.active + base, std::min(kLanes, paths.active_count - base));
      const PathLanes<Lane> path = load_paths<Lane>(paths, g.slot);
      const LaneMask hit = LaneMask(path.prim >= 0);
      const Surface<Lane> s = surface_at<Lane, true>(
          context.scene, select(hit, path.prim, LaneInt{}), select(hit, path.instance, splat_int<Lane>(-1)),
          path.origin, path.direction, times_of_slots(context.scene, paths, g.slot));
      for (unsigned bits = mask_bits(g.active); bits; bits &= bits - 1) {
        const int l = std::countr_zero(bits);
        const auto slot = static_cast<size_t>(lane(g.slot, l));
        normal_[slot] = {lane(s.ng.x, l), lane(s.ng.y, l), lane(s.ng.z, l)};
        before_[slot] = direction_of(paths, slot);
      }
    }
  }
  /// Paths have gone on from there.
  void leave(const Paths& paths) {
    for (int i = 0; i < paths.active_count; ++i) {
      const auto slot = static_cast<size_t>(paths.active[i]);
      const Vec3<float>& n = normal_[slot];
      events[slot].prepend(dot(before_[slot], n) * dot(direction_of(paths, slot), n) > 0);
    }
  }

  std::array<SpecularEvents, kWavefront> events{};
  std::array<int32_t, kWavefront> light{};
  std::array<Vec3<float>, kWavefront> from{}, emitted{};

 private:
  static Vec3<float> direction_of(const Paths& paths, size_t slot) {
    const float* d = paths.rays[slot].direction;
    return {d[0], d[1], d[2]};
  }
  std::array<Vec3<float>, kWavefront> normal_{}, before_{};
};

/// A wavefront of light paths, which can be followed more than once.
class LightPaths {
 public:
  LightPaths(const StageContext& of_scene, size_t number)
      : context_(of_scene), wavefront_(std::make_unique<Wavefront>()) {
    // Light paths need these to know whether camera paths could make them.
    context_.strategies = kEmissionHits | kNextEvent | kVertexConnections;
    context_.max_depth = kPhotonDepth;
    prepare(context_, wavefront_.get());
    layer_.light_key = stream_key(kPhotonSeed, kLightStream, 0, 0);
    layer_.first_light_path = static_cast<int>(number) * kWavefront;
    layer_.light_paths = layer_.first_light_path + kWavefront;
  }

  /// Puts all paths at their start and follows those that `start` leaves active. `log`, if not null, is told
  /// what happens.
  template <class Start>
  std::vector<Vertex> follow(Start&& start, EventLog* log = nullptr) {
    Wavefront& w = *wavefront_;
    produce_light_paths(context_, layer_, w);
    if (log) log->start(w.paths);
    start(&w.paths);
    std::vector<Vertex> arrivals;
    for (int depth = 1; w.paths.active_count > 0 && depth <= kPhotonDepth; ++depth) {
      w.light_vertices.clear();
      cast_light_paths(context_, layer_, depth, w);
      if (log) log->meet(context_, w.paths);
      bounce_light_paths(context_, layer_, depth, w);
      if (depth > 1) arrivals.insert(arrivals.end(), w.light_vertices.begin(), w.light_vertices.end());
      // What can be joined ends the path.
      std::array<bool, kWavefront> ended{};
      for (const Vertex& v : w.light_vertices) ended[static_cast<size_t>(v.path())] = true;
      w.paths.end(ended);
      if (log) log->leave(w.paths);
    }
    return arrivals;
  }

 private:
  StageContext context_;
  LayerContext layer_;
  std::unique_ptr<Wavefront> wavefront_;
};

/// A photon of a path and the vertex that it is at.
struct PhotonArrival {
  int32_t slot = 0;
  int depth = 0;  // 0: there is none
  Photon photon;
};

/// The photons that are of use.
std::vector<PhotonArrival> photons_at(const std::vector<Vertex>& vertices, PhotonUse use) {
  std::vector<PhotonArrival> arrivals;
  for (const Vertex& v : vertices) {
    const float* t = &v.f[Vertex::kThroughput];
    const float power = (t[0] + t[1] + t[2]) / 3;
    // dVC is 0 where nothing can hit the light.
    if (use == PhotonUse::kGuide && (!is_guided(v.kind()) || !(v.f[Vertex::kDvc] > 0))) continue;
    if (v.kind() == kPhaseFunction) continue;
    if (!(power > 0 && std::isfinite(power))) continue;
    PhotonArrival& a = arrivals.emplace_back();
    a.slot = v.path();
    a.depth = v.depth();
    a.photon.p = v.vec(Vertex::kP);
    a.photon.w = v.vec(Vertex::kWo);
    a.photon.normal = v.vec(Vertex::kNg);
    a.photon.power = power;
  }
  return arrivals;
}

/// Moves path `slot` a little in direction `side` (0 or 1) so that it still comes from the same point of the
/// light: those of lights at infinity by their origin, others by their direction.
void move(const LightTable& lights, int32_t slot, int side, Paths* paths) {
  constexpr float kStep = 0x1p-11f;
  PathLanes<float> path = load_paths<float>(*paths, slot);
  const Frame<float> frame(path.direction);
  const Vec3<float> step = (side == 0 ? frame.s : frame.t) * kStep;
  const LightType type = lights.type[static_cast<size_t>(path.light)];
  if (type == kInfiniteLight || type == kDistantLight) {
    path.origin = path.origin + step;
  } else {
    path.direction = normalize(path.direction + step);
  }
  store_paths(path, slot, 1, paths);
}

/// How the direction of photon `a` changes with its place, from two neighbours from the same point of the
/// light. Zero if they went another way, or all meet in one point.
std::array<float, 9> turn_of(const PhotonArrival& a, const std::array<PhotonArrival, 2>& neighbours) {
  constexpr float kFar = 0.1f;
  const Vec3<float>& p = a.photon.p;
  const Vec3<float>& w = a.photon.w;
  std::array<Vec3<float>, 2> step, change;
  for (size_t k = 0; k < 2; ++k) {
    const PhotonArrival& b = neighbours[k];
    if (b.depth != a.depth) return {};
    const Vec3<float>& wb = b.photon.w;
    // Where its ray crosses the plane across the photon's own: along a ray nothing changes.
    const float cosine = dot(wb, w);
    if (!(cosine > 0.5f)) return {};
    const Vec3<float> q = b.photon.p - p;
    step[k] = q - wb * (dot(q, w) / cosine);
    change[k] = wb - w;
    if (!(dot(step[k], step[k]) < kFar * kFar)) return {};
  }
  const Vec3<float> normal = cross(step[0], step[1]);
  const float area2 = dot(normal, normal), scale = dot(step[0], step[0]) * dot(step[1], step[1]);
  if (!(area2 > 1e-6f * scale)) return {};
  const std::array<Vec3<float>, 2> dual{cross(step[1], normal) * (1 / area2),
                                        cross(normal, step[0]) * (1 / area2)};
  const auto row = [&](float c0, float c1) { return dual[0] * c0 + dual[1] * c1; };
  const Vec3<float> x = row(change[0].x, change[1].x), y = row(change[0].y, change[1].y),
                    z = row(change[0].z, change[1].z);
  return {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z};
}

}  // namespace

std::vector<Vertex> arrivals_of_wavefront(const StageContext& context, size_t number) {
  return LightPaths(context, number).follow([](Paths*) {});
}

std::vector<Photon> photons_of_wavefront(const StageContext& context, size_t number, PhotonUse use) {
  LightPaths light_paths(context, number);
  const auto log = use == PhotonUse::kWalks ? std::make_unique<EventLog>() : nullptr;
  std::vector<PhotonArrival> arrivals = photons_at(light_paths.follow([](Paths*) {}, log.get()), use);
  if (log) {
    for (PhotonArrival& a : arrivals) {
      const auto slot = static_cast<size_t>(a.slot);
      a.photon.light = log->light[slot];
      a.photon.events = log->events[slot];
      a.photon.from = log->from[slot];
      a.photon.emitted = log->emitted[slot];
    }
    std::erase_if(arrivals,
                  [&](const PhotonArrival& a) { return !has_targets(context.lights, a.photon.light); });
  }
  // Paths by the same random numbers go the same way.
  std::array<std::vector<PhotonArrival>, 2> moved{std::vector<PhotonArrival>(kWavefront),
                                                  std::vector<PhotonArrival>(kWavefront)};
  for (int side = 0; side < 2 && !arrivals.empty(); ++side) {
    const std::vector<Vertex> vertices = light_paths.follow([&](Paths* paths) {
      paths->active_count = 0;
      for (const PhotonArrival& a : arrivals) {
        move(context.lights, a.slot, side, paths);
        paths->active[paths->active_count++] = a.slot;
      }
    });
    for (const PhotonArrival& a : photons_at(vertices, use))
      moved[static_cast<size_t>(side)][static_cast<size_t>(a.slot)] = a;
  }
  std::vector<Photon> photons;
  for (const PhotonArrival& a : arrivals) {
    const auto slot = static_cast<size_t>(a.slot);
    photons.push_back(a.photon);
    photons.back().turn = turn_of(a, {moved[0][slot], moved[1][slot]});
  }
  return photons;
}

}  // namespace lightmill
