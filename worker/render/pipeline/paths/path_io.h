#pragma once
// Paths between memory (a ray and what it carries, by slot) and lanes.
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A path per lane.
template <class F>
struct PathLanes {
  Vec3<F> origin, direction, throughput;
  F dvcm{}, dvc{}, cos_light{};
  IntOf<F> prim{}, instance{}, light{};  // the first two are set by the caster
  IntOf<F> medium{};                     // that the ray starts in
};

template <class F>
inline PathLanes<F> load_paths(const Paths& paths, IntOf<F> slot) {
  F ray[8], carried[8];
  load_records(as_records(paths.rays), slot, ray);
  load_records(paths.carried, slot, carried);
  const auto integer = [](F x) { return as_int(float_bits(x)); };
  return {{ray[0], ray[1], ray[2]},
          {ray[3], ray[4], ray[5]},
          {carried[Paths::kThroughput], carried[Paths::kThroughput + 1], carried[Paths::kThroughput + 2]},
          carried[Paths::kDvcm],
          carried[Paths::kDvc],
          carried[Paths::kCosLight],
          integer(ray[6]),
          integer(ray[7]),
          integer(carried[Paths::kLight]),
          integer(carried[Paths::kMedium])};
}

/// Of the lanes in `mask`.
template <class F>
inline void store_paths(const PathLanes<F>& p, IntOf<F> slot, unsigned mask, Paths* paths) {
  const auto bits = [](IntOf<F> x) { return bits_float(as_uint(x)); };
  const F ray[8] = {p.origin.x,    p.origin.y,    p.origin.z,   p.direction.x,
                    p.direction.y, p.direction.z, bits(p.prim), bits(p.instance)};
  const F carried[8] = {p.throughput.x, p.throughput.y, p.throughput.z, p.dvcm,
                        p.dvc,          bits(p.light),  p.cos_light,    bits(p.medium)};
  store_records(as_records(paths->rays), slot, mask, ray);
  store_records(paths->carried, slot, mask, carried);
}

}  // namespace lightmill
