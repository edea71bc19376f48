#include "worker/render/pipeline/walks/subsurface_walk.h"

#include <bit>
#include <limits>

#include "worker/render/bsdf/henyey_greenstein.h"
#include "worker/render/math/exp.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/sampling/warp.h"
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/materials/mix.h"
#include "worker/render/scene/media/subsurface_body.h"

namespace lightmill {
namespace {

/// From kFreeSteps = K on a walk gets to step n with probability sqrt(K / n) at most; from kManySteps on this
/// falls like n^-2. So even a walk that is lost in an endless body takes a thousand steps on average.
constexpr int kFreeSteps = 64, kManySteps = 4096;
float longest_share(int n) {
  const float rest = 1 - 1 / static_cast<float>(n);
  return n < kFreeSteps ? 1 : n < kManySteps ? sqrt(rest) : rest * rest;
}
/// Walks whose throughput has fallen below this share of what entered play roulette for the rest.
constexpr float kFaint = 0.25f;

/// Random numbers of a step. They have a key of their own per vertex, as the number of steps has no bound.
enum StepDim : uint32_t {
  kDimChannel = 0,
  kDimDistance = 1,
  kDimLeave = 2,
  kDimTurn = 3,  // and 4
  kDimEnd = 5,
  kDimsPerStep = 8
};
constexpr uint32_t kDimWalk = 0x80000000u;  // + depth: beyond those of vertices
SampleStream<Lane> walk_stream(const SampleStream<Lane>& path, int depth) {
  return {hash_combine(path.key, kDimWalk + static_cast<uint32_t>(depth)), path.index};
}

Vec3<Lane> cosine_direction(const SampleStream<Lane>& stream, uint32_t dim, const Vec3<Lane>& normal) {
  return Frame<Lane>(normal).to_world(
      square_to_cosine_hemisphere(stream.get_random(dim), stream.get_random(dim + 1)));
}

Vec3<Lane> transmitted(const Vec3<Lane>& extinction, Lane way) {
  return {exp_negative(-extinction.x * way), exp_negative(-extinction.y * way),
          exp_negative(-extinction.z * way)};
}

/// Draws how far segments go if nothing is in their way.
Lane draw_way(const SampleStream<Lane>& stream, uint32_t dim, const Vec3<Lane>& throughput,
              const Vec3<Lane>& extinction) {
  const Lane pick = stream.get_random(dim + kDimChannel) * (throughput.x + throughput.y + throughput.z);
  const Lane chosen =
      select(LaneMask(pick < throughput.x), extinction.x,
             select(LaneMask(pick < throughput.x + throughput.y), extinction.y, extinction.z));
  const Lane u = stream.get_random(dim + kDimDistance);
  const LaneMask collides = LaneMask(chosen > 0.0f);
  return select(collides, minus_log_one_minus(u, 1.0f - u) / select(collides, chosen, splat<Lane>(1.0f)),
                splat<Lane>(std::numeric_limits<float>::infinity()));
}

/// Which of the lanes in `arrives`, on surfaces with the boundary's material, are at the body. Elsewhere a
/// mix, but by Blender's rules, is another material there, and lets nothing out.
LaneMask at_body(const RenderScene& scene, LaneInt boundary, LaneInt body, LaneMask arrives, LaneInt prim,
                 const Surface<Lane>& s) {
  if (!scene.any_mix) return arrives;
  Lane unused = splat<Lane>(1.0f);
  const LaneInt material = resolve_mixes<Lane>(scene, boundary, arrives, prim, s, &unused, nullptr, &body);
  const LaneMask right = enters_bodies<Lane>(gather(scene.material_kind.data(), material));
  const Lane number = gather(scene.material_params.data() + kBodyNumberSlot, material * kBsdfParams);
  return mask_and(arrives, mask_and(right, LaneMask(to_int(select(right, number, Lane{})) == body)));
}

/// Step `n` of `g`: to a collision, to the boundary, or to a surface on the way. Those that go on are added
/// to m.next, those that leave to m.leaving.
void step(const RenderScene& scene, const SampleStream<Lane>& stream, int n, const Group& g, Paths& paths,
          BodyWalks& m) {
  const uint32_t dim = static_cast<uint32_t>(n) * kDimsPerStep;
  PathLanes<Lane> path = load_paths<Lane>(paths, g.slot);
  const Vec3<Lane> o = path.origin, d = path.direction;
  const LaneInt number = gather(m.body, g.slot), boundary = gather(m.boundary, g.slot);
  const BodyRecord<Lane> body(scene.bodies.data(), number);
  const Vec3<Lane> extinction = body.extinction();
  Lane left = gather(m.left, g.slot);
  left = select(LaneMask(left < 0.0f), draw_way(stream, dim, path.throughput, extinction), left);

  const LaneMask hit = mask_and(g.active, LaneMask(path.prim >= 0));
  Lane far = splat<Lane>(std::numeric_limits<float>::infinity());
  Surface<Lane> s{};
  if (any(hit)) {
    // The other lanes take a primitive that exists.
    const int first = std::countr_zero(mask_bits(hit));
    s = surface_at<Lane>(scene, select(hit, path.prim, splat_int<Lane>(lane(path.prim, first))),
                         select(hit, path.instance, splat_int<Lane>(lane(path.instance, first))), o, d,
                         times_of_slots(scene, paths, g.slot));
    const Vec3<Lane> segment = s.p - o;
    far = select(hit, sqrt(dot(segment, segment)), far);
  }
  const LaneMask collides = mask_and(g.active, LaneMask(left < far));
  const LaneMask meets = mask_and(hit, mask_not(collides));
  const Lane outside = gather(m.outside, g.slot);
  const LaneInt material = gather(scene.primitive_material.data(), select(hit, path.prim, LaneInt{}));
  const LaneMask of_boundary = mask_and(meets, LaneMask(material == boundary));
  const Lane outward = dot(s.ng, d) * outside;
  const LaneMask goes_out = mask_and(of_boundary, LaneMask(outward > 0.0f));
  const LaneMask goes_in = mask_and(of_boundary, LaneMask(outward < 0.0f));
  const LaneInt within = gather(m.within, g.slot);
  const LaneMask arrives = mask_and(goes_out, LaneMask(within == 0));
  const Lane gone = gather(m.gone, g.slot) + min(left, far);

  const LaneMask passes = mask_and(meets, mask_not(arrives));
  if (any(passes)) {
    PathLanes<Lane> beyond = path;
    beyond.origin = offset_origin(s.p, s.error, s.ng, d);
    store_paths(beyond, g.slot, mask_bits(passes), &paths);
    scatter(m.left, g.slot, max(left - far, Lane{}), passes);
    scatter(m.gone, g.slot, gone, passes);
    const LaneInt one = splat_int<Lane>(1);
    scatter(m.within, g.slot, within + select(goes_in, one, select(goes_out, -one, LaneInt{})), passes);
  }
  const LaneMask ends = mask_or(collides, arrives);
  if (!any(ends)) {
    append(&m.next, g.slot, passes);
    return;
  }

  // The segment's weight.
  const Vec3<Lane>& before = path.throughput;
  const Vec3<Lane> through = transmitted(extinction, gone);
  const Lane sum = before.x + before.y + before.z;
  const Vec3<Lane> share = before * (1.0f / select(LaneMask(sum > 0.0f), sum, splat<Lane>(1.0f)));
  const Lane density = select(collides, dot(share, extinction * through), dot(share, through));
  const LaneMask possible = LaneMask(density > 0.0f);
  const Vec3<Lane> arrived = before * through * (1.0f / select(possible, density, splat<Lane>(1.0f)));
  const Vec3<Lane> albedo{gather(m.albedo[0], g.slot), gather(m.albedo[1], g.slot),
                          gather(m.albedo[2], g.slot)};
  path.throughput = select(collides, arrived * extinction * albedo, arrived);
  scatter(m.collisions, g.slot, gather(m.collisions, g.slot) + 1.0f, collides);

  // Leaves, or goes on in another direction.
  LaneMask leaves = splat_mask<Lane>(false);
  Vec3<Lane> turned{}, from = o + d * min(left, far);
  if (any(arrives)) {
    leaves = mask_and(at_body(scene, boundary, number, arrives, path.prim, s),
                      LaneMask(stream.get_random(dim + kDimLeave) < body.scalar(kBodyLeaves)));
    const Vec3<Lane> inward = s.ng * -outside;
    turned = cosine_direction(stream, dim + kDimTurn, select(arrives, inward, d));
    from = select(arrives, offset_origin(s.p, s.error, s.ng, turned), from);
  }
  if (any(collides)) {
    BsdfParams<Lane> phase;
    phase.p[0] = body.scalar(kBodyG);
    const BsdfSample<Lane> scattered = sample_henyey_greenstein(phase, stream.get_random(dim + kDimTurn),
                                                                stream.get_random(dim + kDimTurn + 1));
    turned = select(collides, Frame<Lane>(-d).to_world(scattered.wi), turned);
  }
  LaneMask lives = mask_and(possible, LaneMask(max_component(path.throughput) > 0.0f));
  leaves = mask_and(leaves, lives);
  store_paths(path, g.slot, mask_bits(leaves), &paths);  // with the ray that got there
  append(&m.leaving, g.slot, leaves);

  const Lane kept = max_component(path.throughput) / gather(m.before, g.slot);
  const Lane survives = min(kept * (1.0f / kFaint), splat<Lane>(1.0f)) * longest_share(n);
  lives = mask_and(lives, LaneMask(stream.get_random(dim + kDimEnd) < survives));
  const LaneMask turns = mask_and(mask_and(ends, mask_not(leaves)), lives);
  path.origin = from;
  path.direction = turned;
  path.throughput = path.throughput * (1.0f / select(turns, survives, splat<Lane>(1.0f)));
  store_paths(path, g.slot, mask_bits(turns), &paths);
  scatter(m.left, g.slot, splat<Lane>(-1.0f), turns);
  scatter(m.gone, g.slot, Lane{}, turns);
  append(&m.next, g.slot, mask_or(passes, turns));
}

}  // namespace

void enter_bodies(const StageContext& context, const SampleStream<Lane>& stream, int depth,
                  const VertexLanes<Lane>& v, LaneInt prim, PathLanes<Lane> carried, LaneMask enters,
                  Wavefront& w) {
  BodyWalks& m = *w.bodies;
  const Lane outside = copysign(splat<Lane>(1.0f), dot(v.ng, v.wo));
  // Random numbers of step 0: steps are counted from 1.
  carried.direction = cosine_direction(walk_stream(stream, depth), kDimTurn, v.ng * -outside);
  carried.origin = offset_origin(v.p, v.error, v.ng, carried.direction);
  store_paths(carried, v.path, mask_bits(enters), &w.paths);
  scatter(m.outside, v.path, outside, enters);
  scatter(m.before, v.path, max_component(carried.throughput), enters);
  for (int c = 0; c < 3; ++c) scatter(m.albedo[c], v.path, v.params.p[c], enters);
  scatter(m.collisions, v.path, Lane{}, enters);
  scatter(m.left, v.path, splat<Lane>(-1.0f), enters);
  scatter(m.gone, v.path, Lane{}, enters);
  scatter(m.within, v.path, LaneInt{}, enters);
  scatter(m.body, v.path, to_int(select(enters, v.params.p[kBodyNumberSlot], Lane{})), enters);
  scatter(m.boundary, v.path, gather(context.scene.primitive_material.data(), prim), enters);
  append(&m.walking, v.path, enters);
}

Vec3<Lane> albedo_from_both_ends(const BodyWalks& walks, LaneInt slot, const Vec3<Lane>& albedo) {
  const Vec3<Lane> entered{gather(walks.albedo[0], slot), gather(walks.albedo[1], slot),
                           gather(walks.albedo[2], slot)};
  const Lane half = gather(walks.collisions, slot) * 0.5f;
  const auto channel = [&](Lane a, Lane b) {
    // A black end leaves nothing to multiply.
    constexpr float kLeast = 1e-12f;
    const Lane x =
        (log_positive(max(b, splat<Lane>(kLeast))) - log_positive(max(a, splat<Lane>(kLeast)))) * half;
    const LaneMask falls = LaneMask(x < 0.0f);
    const Lane e = exp_negative(select(falls, x, -x));
    return select(falls, e, 1.0f / e);
  };
  return {channel(entered.x, albedo.x), channel(entered.y, albedo.y), channel(entered.z, albedo.z)};
}

void walk_through_bodies(const StageContext& context, const LayerContext& layer, bool light, int depth,
                         Wavefront& w) {
  BodyWalks& m = *w.bodies;
  m.leaving.clear();
  for (int n = 1; !m.walking.empty(); ++n) {
    context.accel.closest_hits(w.paths.rays, m.walking.data(), static_cast<int>(m.walking.size()),
                               times_of_rays(context.scene, w.paths));
    w.counters.closest_hit_rays += m.walking.size();
    if (w.recorder) w.recorder->walk_steps(light, m.walking);
    m.next.clear();
    for (size_t base = 0; base < m.walking.size(); base += kLanes) {
      const Group g(m.walking, base);
      const SampleStream<Lane> path =
          light ? layer.light_stream<Lane>(g.slot) : layer.camera_stream<Lane>(g.slot);
      step(context.scene, walk_stream(path, depth), n, g, w.paths, m);
    }
    m.walking.swap(m.next);
  }
}

}  // namespace lightmill
