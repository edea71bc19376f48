#include "worker/render/pipeline/walks/manifold_walk.h"

#include <array>

namespace lightmill {
namespace {

/// Rounds of a walk. Twice as many found a tenth more on water with many waves, for half as much time again.
constexpr int kMostRounds = 8;
/// Angle between neighbours, and a correction so small that the walk ends with it: the error left is its
/// square.
constexpr float kStep = 0x1p-12f, kEnd = 0x1p-13f;
/// A round turns the direction by no more than this.
constexpr float kMostTurn = 0.2f;
constexpr float kFar = 1e30f;

/// How far chains end from the target: across the ray of the first, or across the direction to it.
struct Misses {
  LaneMask ahead;
  std::array<Lane, kChains> x, y;
  std::array<LaneMask, kChains> known;
};

Misses misses_of(const std::array<ChainEnd, kChains>& ends, const WalkTarget& target) {
  Misses m;
  const Vec3<Lane> axis = select(target.infinite, target.at, ends[0].direction);
  const Frame<Lane> frame(axis);
  for (size_t k = 0; k < ends.size(); ++k) {
    const Vec3<Lane>& d = ends[k].direction;
    const Lane cosine = dot(d, axis);
    m.known[k] = LaneMask(cosine > 0.5f);
    const Lane distance =
        dot(target.at - ends[k].origin, axis) / select(m.known[k], cosine, splat<Lane>(1.0f));
    if (k == 0) m.ahead = mask_or(target.infinite, LaneMask(distance > 0.0f));
    const Vec3<Lane> off = select(target.infinite, d, ends[k].origin + d * distance - target.at);
    m.x[k] = dot(off, frame.s);
    m.y[k] = dot(off, frame.t);
  }
  return m;
}

}  // namespace

WalkEnd walk_manifold(const StageContext& context, const ChainStart& start, LaneMask active,
                      const Vec3<Lane>& first, const WalkTarget& target, Wavefront& chains,
                      RenderCounters* counters) {
  WalkEnd result;
  result.events = start.events;
  Vec3<Lane> w = first, before = first;
  Lane least = splat<Lane>(kFar);  // square of the miss at `before`
  Lane side_x = splat<Lane>(kStep), side_y = side_x;
  LaneMask turned_x = splat_mask<Lane>(false), turned_y = turned_x;
  for (int round = 0; round < kMostRounds && any(active); ++round) {
    const Frame<Lane> frame(w);
    const std::array<Vec3<Lane>, kChains> directions{w, normalize(w + frame.s * side_x),
                                                     normalize(w + frame.t * side_y)};
    const std::array<ChainEnd, kChains> ends =
        follow_chains(context, start, active, directions, chains, counters);
    result.rays = result.rays + select(active, SpecularEvents::count_of(start.events) * kChains, LaneInt{});
    const Misses m = misses_of(ends, target);
    const Lane miss = m.x[0] * m.x[0] + m.y[0] * m.y[0];
    // Goes back half of the way if that did not lead nearer.
    const LaneMask there = mask_and(mask_and(active, ends[0].reached), mask_and(m.known[0], m.ahead));
    const LaneMask nearer = mask_and(there, LaneMask(miss <= least));
    const LaneMask back = mask_and(active, mask_not(nearer));
    active = mask_and(active, mask_not(mask_and(back, LaneMask(least == kFar))));
    w = select(back, normalize(w + before), w);
    // A neighbour that met something else may lie beyond an edge: then the other side serves.
    const auto beside = [&](size_t k) { return mask_and(ends[k].reached, m.known[k]); };
    const auto alike = [&](size_t k) {
      return mask_and(beside(k), LaneMask(ends[k].trace == ends[0].trace));
    };
    const LaneMask turn_x = mask_and(nearer, mask_not(mask_or(alike(1), turned_x))),
                   turn_y = mask_and(nearer, mask_not(mask_or(alike(2), turned_y)));
    side_x = select(turn_x, -side_x, side_x);
    side_y = select(turn_y, -side_y, side_y);
    turned_x = mask_or(turned_x, turn_x);
    turned_y = mask_or(turned_y, turn_y);
    const LaneMask wait = mask_or(turn_x, turn_y);
    const LaneMask lost =
        mask_and(mask_and(nearer, mask_not(wait)), mask_not(mask_and(beside(1), beside(2))));
    active = mask_and(active, mask_not(lost));
    const LaneMask steps = mask_and(mask_and(nearer, active), mask_not(wait));
    const Lane ax = (m.x[1] - m.x[0]) / side_x, ay = (m.y[1] - m.y[0]) / side_x,
               bx = (m.x[2] - m.x[0]) / side_y, by = (m.y[2] - m.y[0]) / side_y;
    const Lane area = ax * by - ay * bx;
    const LaneMask regular = mask_and(steps, LaneMask(abs(area) > 1e-20f));
    active = mask_and(active, mask_not(mask_and(steps, mask_not(regular))));
    const Lane per_area = 1.0f / select(regular, area, splat<Lane>(1.0f));
    Lane dx = (m.y[0] * bx - m.x[0] * by) * per_area, dy = (ay * m.x[0] - ax * m.y[0]) * per_area;
    const Lane turn = sqrt(dx * dx + dy * dy);
    const LaneMask ended = mask_and(regular, LaneMask(turn < kEnd)),
                   goes_on = mask_and(regular, mask_not(ended));
    const Lane scale = min(splat<Lane>(kMostTurn) / max(turn, splat<Lane>(kMostTurn)), splat<Lane>(1.0f));
    const Vec3<Lane> next = normalize(w + frame.s * (dx * scale) + frame.t * (dy * scale));
    if (any(ended)) {
      result.found = mask_or(result.found, ended);
      result.w = select(ended, next, result.w);
      result.density = select(ended, abs(per_area), result.density);
      result.origin = select(ended, ends[0].origin, result.origin);
      result.direction = select(ended, ends[0].direction, result.direction);
      result.throughput = select(ended, ends[0].throughput, result.throughput);
      active = mask_and(active, mask_not(ended));
    }
    before = select(goes_on, w, before);
    least = select(goes_on, miss, least);
    w = select(goes_on, next, w);
    turned_x = mask_and(turned_x, mask_not(goes_on));
    turned_y = mask_and(turned_y, mask_not(goes_on));
  }
  return result;
}

}  // namespace lightmill
