#include "worker/render/guiding/training/manifold_training.h"

#include <algorithm>

#include "common/base/parallel.h"
#include "worker/render/guiding/manifold_targets.h"
#include "worker/render/guiding/training/photon_tracing.h"
#include "worker/render/pipeline/walks/manifold_walk.h"

namespace lightmill {
namespace {

/// Light that is missing, over that of the image, from which on walks are worth their time.
constexpr double kMissing = 0.01;
/// The same for the noise of light that emitter hits find. relMSE x time with walks over that without: 0.6
/// where this noise is 1000 (a ring under a small lamp); 0.9 where it is 300 and 50 (a pool, a table of
/// glass); 1.3 to 1.5 where it is 20, 16 and 4 (a pool out of focus, veach-bidir, an aquarium). Where it is
/// 5000 (a glass ball), 1.7 at 32 samples, among which few such hits are, and 0.9 at 256: the more samples,
/// the more of it shows.
constexpr double kNoisy = 100;
/// The part of what photons bring that walks must find. Where waves are many, so are the ways, and walks that
/// find a few of them take most of the time.
constexpr double kLeastFound = 0.5;
/// Irradiance from which on all vertices walk, over that of white surfaces of the image's mean radiance.
/// Vertices to which walks bring less make little noise if only some of them walk. Of 0.1, 0.4, 1 and 2 tried
/// on a few pools, balls and lenses: with less more time is lost, with 2 a pool has more noise than it saves.
constexpr double kWorthAWalk = 1;
/// Most light paths that are followed, in all and per pixel of a small image; and photons that are enough, in
/// rounds of this many wavefronts.
constexpr int64_t kMostPaths = int64_t{1} << 20, kWalkPathsPerPixel = 64;
constexpr size_t kSeedPhotons = size_t{1} << 15, kSeedRound = 64;
/// Photons that judge what walks find.
constexpr size_t kTried = size_t{1} << 12;

/// Keeps the seeds of a group without which some way would not be found: ways that other seeds find from some
/// of the photons' places.
void drop_needless(const StageContext& context, Wavefront& chains, ManifoldGroup* group,
                   std::vector<ManifoldSeed>* seeds) {
  static_assert(ManifoldSeeds::kMost <= kLanes);
  const auto seed = [&](int32_t i) -> ManifoldSeed& {
    return (*seeds)[static_cast<size_t>(group->first + i)];
  };
  const LaneMask all = LaneMask(lane_index<Lane>() < group->count);
  std::array<uint64_t, ManifoldSeeds::kMost> finds{};  // of each seed: bits of ways
  int ways = 0;
  RenderCounters unused;
  for (int32_t place = 0; place < group->count; ++place) {
    const Vec3<float> p = seed(place).p, normal = seed(place).normal;
    ChainStart start{.p = splat3<Lane>(p.x, p.y, p.z), .ng = splat3<Lane>(normal.x, normal.y, normal.z)};
    start.error = position_error(start.p, 0x1p-21f);
    Vec3<Lane> first = splat3<Lane>(0, 0, 1);
    for (int i = 0; i < group->count; ++i) {
      const ManifoldSeed& s = seed(i);
      const Vec3<float> w = followed(s.p, s.w, s.turn, p);
      set_lane(&first, i, w);
      set_lane(&start.events, i, s.events);
    }
    const Vec3<float>& a = group->axis;
    const Lane u = splat<Lane>((static_cast<float>(place) + 0.5f) / ManifoldSeeds::kMost);
    const LightTarget<Lane> target = sample_target<Lane>(
        context.lights, splat_int<Lane>(group->light), splat3<Lane>(a.x, a.y, a.z), u, splat<Lane>(1.0f) - u);
    const WalkEnd end =
        walk_manifold(context, start, all, first, {target.at, target.infinite}, chains, &unused);
    LaneMask left = end.found;
    while (any(left)) {
      const int i = std::countr_zero(mask_bits(left));
      const Vec3<Lane> w = splat3<Lane>(lane(end.w.x, i), lane(end.w.y, i), lane(end.w.z, i));
      const LaneMask same = mask_and(left, found_way(end, w, splat_int<Lane>(lane(end.events, i))));
      for (unsigned bits = mask_bits(same); bits; bits &= bits - 1)
        finds[static_cast<size_t>(std::countr_zero(bits))] |= uint64_t{1} << ways;
      left = mask_and(left, mask_not(same));
      ++ways;
    }
  }
  uint64_t found = 0;
  int32_t kept = 0;
  for (;; ++kept) {
    const auto more = [&](size_t i) { return std::popcount(finds[i] & ~found); };
    size_t best = 0;
    for (size_t i = 1; i < finds.size(); ++i) {
      if (more(i) > more(best)) best = i;
    }
    if (more(best) == 0) break;
    found |= finds[best];
    // What is put in its place has been kept or is needless; its ways are found from now on.
    std::swap(seed(kept), seed(static_cast<int32_t>(best)));
    std::swap(finds[static_cast<size_t>(kept)], finds[best]);
  }
  group->count = kept;
}

/// Part of the power of `photons` that came by ways which walks find, from where the photons are to where
/// they left their lights.
double found_of(const StageContext& context, const std::vector<Photon>& photons, int threads) {
  const LightTable& lights = context.lights;
  constexpr size_t kChunk = 256;
  struct Power {
    double all = 0, found = 0;
  };
  std::vector<Power> sums((photons.size() + kChunk - 1) / kChunk);
  parallel_for(sums.size(), threads, [&](size_t chunk) {
    const auto chains = std::make_unique<Wavefront>();
    RenderCounters unused;
    const size_t end = std::min(photons.size(), (chunk + 1) * kChunk);
    for (size_t base = chunk * kChunk; base < end; base += kLanes) {
      ChainStart start;
      WalkTarget target;
      Vec3<Lane> came;
      LaneInt events{};
      std::array<const ManifoldGroup*, kLanes> groups{};
      const auto count = static_cast<int>(std::min<size_t>(kLanes, end - base));
      for (int l = 0; l < count; ++l) {
        const Photon& p = photons[base + static_cast<size_t>(l)];
        const bool infinite = lights.type[static_cast<size_t>(p.light)] >= kInfiniteLight;
        set_lane(&start.p, l, p.p);
        set_lane(&start.ng, l, p.normal);
        set_lane(&came, l, p.w);
        set_lane(&events, l, p.events.code());
        set_lane(&target.at, l, infinite ? -p.emitted : p.from);
        set_lane(&target.infinite, l, infinite ? -1 : 0);
        groups[static_cast<size_t>(l)] = group_at(
            context.scene.manifolds, p.p, [&](const ManifoldGroup& g, bool) { return g.light == p.light; });
      }
      start.error = position_error(start.p, 0x1p-21f);
      const LaneMask active = LaneMask(lane_index<Lane>() < count);
      LaneMask found = splat_mask<Lane>(false);
      for_each_way(context, start, active, groups, splat_int<Lane>(kPhotonDepth), target, *chains, &unused,
                   [&](const WalkEnd& way) { found = mask_or(found, found_way(way, came, events)); });
      for (int l = 0; l < count; ++l) {
        const double power = double{photons[base + static_cast<size_t>(l)].power};
        sums[chunk].all += power;
        if (mask_bits(found) >> l & 1) sums[chunk].found += power;
      }
    }
  });
  Power sum;
  for (const Power& s : sums) sum.all += s.all, sum.found += s.found;
  return sum.all > 0 ? sum.found / sum.all : 0;
}

}  // namespace

void train_manifold_seeds(const StageContext& context, int threads, RenderScene* scene,
                          MissingLight* missing) {
  // In media, segments are not simply free or blocked.
  if (scene->any_media()) return;
  // Nor do walks know times.
  if (context.lights.any_moving()) return;
  const MissingShare share = missing->up_to(2 * kPhotonDepth);
  if (!(share.never + share.seldom >= kMissing || share.noise >= kNoisy)) return;
  std::vector<Photon> photons;
  const auto wavefronts =
      static_cast<size_t>(std::min(kMostPaths, kWalkPathsPerPixel * context.grid.crop.area()) / kWavefront);
  const auto trace = [&](size_t number) { return photons_of_wavefront(context, number, PhotonUse::kWalks); };
  const size_t next = trace_wavefronts(0, wavefronts, kSeedRound, kSeedPhotons, threads, trace, &photons);
  scene->manifolds = make_manifold_seeds(photons, static_cast<double>(next * kWavefront));
  ManifoldSeeds& seeds = scene->manifolds;
  if (seeds.empty()) return;
  seeds.worth_a_walk = static_cast<float>(kWorthAWalk * M_PI * missing->image);
  photons.clear();
  trace_wavefronts(next, wavefronts + next, kSeedRound, kTried, threads, trace, &photons);
  seeds.found = found_of(context, photons, threads);
  if (!(seeds.found >= kLeastFound)) {
    seeds = {};
    return;
  }
  missing->walked = seeds.found * share.all;
  for (MissingShare& part : missing->parts) {
    const double left = 1 - seeds.found;
    part.never *= left, part.seldom *= left, part.emitter_hits *= left, part.noise *= left;
  }
  constexpr size_t kChunk = 64;
  parallel_for((seeds.groups.size() + kChunk - 1) / kChunk, threads, [&](size_t chunk) {
    const auto chains = std::make_unique<Wavefront>();
    for (size_t k = chunk * kChunk; k < std::min(seeds.groups.size(), (chunk + 1) * kChunk); ++k)
      drop_needless(context, *chains, &seeds.groups[k], &seeds.seeds);
  });
  for (const ManifoldGroup& group : seeds.groups) {
    const LightType type = scene->lights.type[static_cast<size_t>(group.light)];
    seeds.meetable |= type <= kLastWithNormal || type == kInfiniteLight;
  }
}

}  // namespace lightmill
