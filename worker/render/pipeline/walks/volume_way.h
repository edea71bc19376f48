#pragma once
// What a walk through a grid is given and what it finds, a way per lane or alone.
#include <bit>
#include <vector>

#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A straight way through a grid, and what has been found on it.
template <class F>
struct VolumeWay {
  IntOf<F> medium{};              // has a grid
  Vec3<F> origin{}, direction{};  // of normalised space; if the grid moves, as the shutter opens
  F from{}, until{};              // from origin + from * direction on
  F length{};                     // of a unit of the direction, where the ray is
  // If the grid moves: the square of that over the same as the shutter opens, and what a density per unit
  // volume then is multiplied by (moving_grids.h).
  F stretch2 = splat<F>(1.0f), density = splat<F>(1.0f);
  IntOf<F> seed{};  // of its random numbers
  // Of a path's segment: the channel that was drawn, and the throughput at its start.
  IntOf<F> channel{};
  Vec3<F> throughput{};
  // Of a camera path's segment, for what shines: where it began, the product of medium_walk.h's panes, and
  // for M6 dVCM times the probability that next-event estimation at `start` chooses the grid, and dVC times
  // that with which light paths do, over 4 pi.
  Vec3<F> start{};
  F panes = splat<F>(1.0f), next_event{}, light_paths{};

  // As far as it has been walked: numbers drawn, optical depth to the next (tentative) collision, depth by
  // extinction and by collision rate of what is integrated, and the product above.
  IntOf<F> drawn{};
  F left{};
  Vec3<F> optical{}, rate{}, nulls = splat3<F>(1, 1, 1);

  IntOf<F> collides{};                   // 1: a path's segment ends
  F at{};                                // there, in units of the direction
  Vec3<F> end_rate{}, end_scattering{};  // coefficients there
  Vec3<F> glow{};                        // emission found on the way, times throughput and weight
  F all_glow{}, light_path_glow{};  // its sum over the channels without weights, and with that of light paths
};
using VolumeWays = std::vector<VolumeWay<float>>;
/// So many are walked together: enough that lanes are seldom idle, and few enough to stay in the cache.
inline constexpr size_t kWaysAtOnce = 256;

/// Calls fn(a's field, b's field) for those that a walk needs.
template <class A, class B, class Fn>
void for_each_given(A& a, B& b, Fn&& fn) {
  fn(a.medium, b.medium), fn(a.seed, b.seed), fn(a.channel, b.channel), fn(a.drawn, b.drawn);
  fn(a.origin, b.origin), fn(a.direction, b.direction), fn(a.throughput, b.throughput), fn(a.start, b.start);
  fn(a.optical, b.optical), fn(a.rate, b.rate), fn(a.nulls, b.nulls);
  fn(a.from, b.from), fn(a.until, b.until), fn(a.left, b.left), fn(a.length, b.length);
  fn(a.stretch2, b.stretch2), fn(a.density, b.density);
  fn(a.panes, b.panes), fn(a.next_event, b.next_event), fn(a.light_paths, b.light_paths);
}
/// The same for those that it finds.
template <class A, class B, class Fn>
void for_each_found(A& a, B& b, Fn&& fn) {
  fn(a.drawn, b.drawn), fn(a.collides, b.collides);
  fn(a.left, b.left), fn(a.at, b.at), fn(a.all_glow, b.all_glow), fn(a.light_path_glow, b.light_path_glow);
  fn(a.optical, b.optical), fn(a.rate, b.rate), fn(a.nulls, b.nulls);
  fn(a.end_rate, b.end_rate), fn(a.end_scattering, b.end_scattering), fn(a.glow, b.glow);
}

/// Copies lane l of a field to a way's, and back.
struct FromLane {
  int l;
  void operator()(Lane from, float& to) const { to = lane(from, l); }
  void operator()(LaneInt from, int32_t& to) const { to = lane(from, l); }
  void operator()(const Vec3<Lane>& from, Vec3<float>& to) const {
    to = {lane(from.x, l), lane(from.y, l), lane(from.z, l)};
  }
};
struct ToLane {
  int l;
  void operator()(float from, Lane& to) const { set_lane(&to, l, from); }
  void operator()(int32_t from, LaneInt& to) const { set_lane(&to, l, from); }
  void operator()(const Vec3<float>& from, Vec3<Lane>& to) const {
    set_lane(&to.x, l, from.x), set_lane(&to.y, l, from.y), set_lane(&to.z, l, from.z);
  }
};

/// Adds the ways of the lanes in `mask`.
inline void append_ways(const VolumeWay<Lane>& ways, LaneMask mask, VolumeWays* to) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1)
    for_each_given(ways, to->emplace_back(), FromLane{std::countr_zero(bits)});
}

/// What has been found on the ways from *next on, for the lanes in `mask` in order; 0 in others.
inline VolumeWay<Lane> take_ways(const VolumeWays& from, size_t* next, LaneMask mask) {
  VolumeWay<Lane> ways;
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1)
    for_each_found(from[(*next)++], ways, ToLane{std::countr_zero(bits)});
  return ways;
}

}  // namespace lightmill
