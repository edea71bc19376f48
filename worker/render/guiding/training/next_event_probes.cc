#include "worker/render/guiding/training/next_event_probes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include "common/base/parallel.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/connections/shadow_queue.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/plan/camera_preview.h"

namespace lightmill {
namespace {

/// Rays of a place: into the bins of the sky, all environments together, and to lights.
constexpr size_t kSkyRays = 8, kLightRays = 2;

bool transmits(int32_t kind) {
  return kind == kRoughDielectric || kind == kDiffuseTransmission || kind == kAnisotropicDielectric ||
         kind == kRoughTintedDielectric || kind == kRoughTintedSheet || kind == kTranslucent ||
         kind == kHair || kind == kRoughGlass;
}

LitPlace place_of(const Vertex& v, float time, bool in_media) {
  const auto at = [&](int slot) { return Vec3f{v.f[slot], v.f[slot + 1], v.f[slot + 2]}; };
  LitPlace place{.p = at(Vertex::kP),
                 .normal = at(Vertex::kNg),
                 .error = v.f[Vertex::kError],
                 .both_sides = transmits(v.kind()),
                 .scatters = v.kind() == kPhaseFunction,
                 .time = time,
                 .media = in_media ? std::bit_cast<int32_t>(v.f[Vertex::kMedia]) : 0,
                 .ng = at(Vertex::kNg)};
  const Vec3f wo = at(Vertex::kWo), n = place.normal;
  if (wo.x * n.x + wo.y * n.y + wo.z * n.z < 0) place.normal = {-n.x, -n.y, -n.z};
  return place;
}

/// The vertices of camera paths that start in one cell of the film.
void follow_paths(const StageContext& context, int cell_x, int cell_y, int64_t samples,
                  const PixelSubset& pixel_subset, int depths, Wavefront* wavefront,
                  std::vector<LitPlace>* places) {
  Wavefront& w = *wavefront;
  const bool moving = context.scene.any_moving();
  w.slots.begin_superblock(context, cell_x, cell_y, 0, pixel_subset);
  for (int64_t s = 0; s < samples; ++s) {
    follow_camera_paths(context, s, depths, w, [&](int) {
      for (const Vertex& v : w.vertices)
        places->push_back(place_of(v, moving ? w.paths.time[v.path()] : 0, w.media != nullptr));
    });
  }
}

}  // namespace

std::vector<LitPlace> find_places(const StageContext& context, int64_t paths, int depth, int threads) {
  const CellRect cells = context.grid.cells();
  const auto count = static_cast<size_t>(cells.count());
  const int64_t pixels = context.grid.crop.area();
  int64_t samples = 1;
  PixelSubset pixel_subset;
  while (samples < kSuperblockSamples && 2 * samples * pixels <= paths) samples *= 2;
  while (pixels > paths * pixel_subset.one_in) pixel_subset.one_in *= 2;
  std::vector<std::vector<LitPlace>> found(count);
  // Threads take strips, each with a wavefront of its own.
  const size_t strips = std::min<size_t>(count, 16);
  parallel_for(strips, threads, [&](size_t strip) {
    const auto wavefront = std::make_unique<Wavefront>();
    prepare(context, wavefront.get());
    for (size_t i = strip; i < count; i += strips) {
      const auto columns = static_cast<size_t>(cells.x1 - cells.x0);
      follow_paths(context, static_cast<int>(i % columns), static_cast<int>(i / columns), samples,
                   pixel_subset, depth, wavefront.get(), &found[i]);
    }
  });
  std::vector<LitPlace> places;
  for (const std::vector<LitPlace>& f : found) places.insert(places.end(), f.begin(), f.end());
  return places;
}

/// Rays that wait to be traced, and the trials that they are of.
struct NextEventProbes::Rays {
  std::vector<float> ox, oy, oz, dx, dy, dz, tfar, time;
  std::vector<int32_t> medium;  // that they start in
  std::vector<size_t> trial;
};

/// Writes the trials of one place.
class NextEventProbes::Caster {
 public:
  Caster(uint32_t index, const LitPlace& place, std::vector<NextEventProbe>* trials, Rays* rays)
      : index_(index),
        place_(place),
        p_{place.p.x, place.p.y, place.p.z},
        n_{place.normal.x, place.normal.y, place.normal.z},
        trials_(*trials),
        rays_(*rays) {}

  const Vec3<float>& point() const { return p_; }
  /// Casts a ray towards `w`. It brings `value` per cosine if it gets away, or to `end` unless that is null.
  void cast(size_t channel, const Vec3<float>& w, double value, float chosen = 1,
            const Vec3<float>* end = nullptr) {
    const double seen = value * double{weight(dot(n_, w))};
    trials_.push_back({index_, static_cast<uint32_t>(channel), seen * seen, chosen});
    if (!(seen > 0)) return;
    const Vec3<float> o = place_.scatters ? p_ : offset_origin(p_, place_.error, n_, w);
    const Vec3<float> d = end ? *end - o : w;
    rays_.ox.push_back(o.x), rays_.oy.push_back(o.y), rays_.oz.push_back(o.z);
    rays_.dx.push_back(d.x), rays_.dy.push_back(d.y), rays_.dz.push_back(d.z);
    rays_.tfar.push_back(end ? kSegmentEnd : std::numeric_limits<float>::infinity());
    rays_.time.push_back(place_.time);
    const float side = dot(Vec3<float>{place_.ng.x, place_.ng.y, place_.ng.z}, w);
    rays_.medium.push_back(medium_on_side<float>(place_.media, side > 0));
    rays_.trial.push_back(trials_.size() - 1);
  }

 private:
  /// What light counts by the cosine of its direction: in a medium as much as on both sides of a surface.
  float weight(float cosine) const {
    if (place_.scatters) return 0.5f;
    return place_.both_sides ? std::fabs(cosine) : std::max(cosine, 0.0f);
  }

  const uint32_t index_;
  const LitPlace& place_;
  const Vec3<float> p_, n_;
  std::vector<NextEventProbe>& trials_;
  Rays& rays_;
};

NextEventProbes::NextEventProbes(const StageContext& context, const std::vector<int32_t>& sky_light)
    : context_(context), lights_(context.lights), light_count_(static_cast<size_t>(lights_.count())) {
  channels_.resize(light_count_);
  for (size_t k = 0; k < lights_.environments.size(); ++k) {
    first_bin_.push_back(channels_.size());
    if (sky_light[k] < 0) continue;
    const EnvironmentMap& map = lights_.environments[k];
    const double texel = 4 * M_PI / (static_cast<double>(map.side) * map.side);  // steradians
    for (int32_t b = 0; b < map.bins.count(); ++b) {
      const double light = map.bins.weight[static_cast<size_t>(b)] * texel;
      if (light > 0) lit_.push_back(channels_.size());
      channels_.push_back({k, b, light});
    }
  }
}

bool NextEventProbes::has_bins(size_t light) const {
  if (lights_.type[light] != kInfiniteLight) return false;
  const float number = lights_.records[light * kLightFloats + 4];
  return number >= 0 && first_bin(static_cast<size_t>(number) + 1) > first_bin(static_cast<size_t>(number));
}

void NextEventProbes::preview_around(uint64_t seed, uint32_t index, const LitPlace& place,
                                     std::vector<NextEventProbe>* trials, Rays* rays) const {
  const SampleStream<float> stream{stream_key(seed, kLightStream, index, 0), 0};
  uint32_t dim = 0;
  const auto random = [&] { return stream.get_random(dim++); };
  Caster caster(index, place, trials, rays);
  // All lit bins equally, evenly.
  const double step = static_cast<double>(lit_.size()) / static_cast<double>(kSkyRays);
  for (size_t i = 0; i < kSkyRays && !lit_.empty(); ++i) {
    const auto at = static_cast<size_t>((static_cast<double>(i) + double{random()}) * step);
    const size_t channel = lit_[std::min(at, lit_.size() - 1)];
    const Channel& c = channels_[channel];
    const EnvironmentMap& map = lights_.environments[c.map];
    const float inv = 1.0f / static_cast<float>(map.bins.side);
    const int32_t column = c.bin % map.bins.side, row = c.bin / map.bins.side;
    const float s = (static_cast<float>(column) + random()) * inv;
    const float t = (static_cast<float>(row) + random()) * inv;
    caster.cast(channel, map.rotate_to_world(equal_area_square_to_sphere(s, t)), c.light);
  }
  for (size_t i = 0; i < kLightRays && draws_lights(); ++i) {
    const float pick = random(), texel = random(), u = random(), v = random();
    const DirectSample<float> d = sample_direct<float>(lights_, caster.point(), pick, texel, u, v);
    const auto light = static_cast<size_t>(d.light);
    if (has_bins(light)) continue;
    const double mean = (double{d.radiance.x} + d.radiance.y + d.radiance.z) / 3;
    const float chosen = direct_selection<float>(lights_, d.light, caster.point());
    const Vec3<float> end = offset_origin(d.point, d.error, d.normal, -d.wi);
    caster.cast(light, d.wi, d.pdf > 0 ? mean * double{chosen} / double{d.pdf} : 0, chosen,
                d.infinite ? nullptr : &end);
  }
}

double NextEventProbes::unguided_square(const std::vector<NextEventProbe>& trials, size_t places) const {
  double sum = 0;
  for (const NextEventProbe& t : trials) {
    if (t.channel < light_count_ && t.chosen > 0) sum += t.square / (double{t.chosen} * t.chosen);
  }
  return sum / static_cast<double>(places * kLightRays);
}

void NextEventProbes::trace(const Rays& rays, std::vector<NextEventProbe>* trials) const {
  std::vector<uint8_t> occluded(rays.trial.size()), through_panes(rays.trial.size());
  context_.accel.occluded({rays.ox.data(), rays.oy.data(), rays.oz.data(), rays.dx.data(), rays.dy.data(),
                           rays.dz.data(), rays.time.data()},
                          rays.tfar.data(), static_cast<int>(rays.trial.size()), occluded.data(),
                          through_panes.data());
  for (size_t r = 0; r < rays.trial.size(); ++r) {
    if (occluded[r]) (*trials)[rays.trial[r]].square = 0;
  }
}

void NextEventProbes::trace_through_media(const Rays& rays, Wavefront* w,
                                          std::vector<NextEventProbe>* trials) const {
  ShadowRays& q = w->shadow;
  constexpr size_t kMost = ShadowRays::kCapacity;
  for (size_t from = 0; from < rays.trial.size(); from += kMost) {
    const size_t count = std::min(rays.trial.size() - from, kMost);
    const auto take = [&](const auto& all, auto* to) {
      std::copy_n(all.begin() + static_cast<ptrdiff_t>(from), count, to);
    };
    take(rays.ox, q.ox), take(rays.oy, q.oy), take(rays.oz, q.oz);
    take(rays.dx, q.dx), take(rays.dy, q.dy), take(rays.dz, q.dz);
    take(rays.tfar, q.tfar), take(rays.time, q.time), take(rays.medium, w->media->shadow_medium);
    for (size_t i = 0; i < count; ++i) {
      q.r[i] = q.g[i] = q.b[i] = 1;
      w->media->shadow_ratio[i] = 0;
      w->media->shadow_volume[i] = 0;
      w->media->shadow_seed[i] = static_cast<int32_t>(hash32(static_cast<uint32_t>(rays.trial[from + i])));
    }
    q.count = static_cast<int>(count);
    trace_transmittance(context_, kShadowRays, *w);
    for (size_t i = 0; i < count; ++i) {
      const double passed = q.occluded[i] ? 0 : (double{q.r[i]} + q.g[i] + q.b[i]) / 3;
      (*trials)[rays.trial[from + i]].square *= passed * passed;
    }
    q.count = 0;
  }
}

std::vector<NextEventProbe> NextEventProbes::run(const std::vector<LitPlace>& places, uint64_t seed,
                                                 int threads) const {
  constexpr size_t kChunk = 1024;
  const size_t chunks = (places.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<NextEventProbe>> found(chunks);
  parallel_for(chunks, threads, [&](size_t i) {
    Rays rays;
    for (size_t k = i * kChunk; k < std::min((i + 1) * kChunk, places.size()); ++k)
      preview_around(seed, static_cast<uint32_t>(k), places[k], &found[i], &rays);
    if (context_.scene.medium_count() > 0) {
      const auto wavefront = std::make_unique<Wavefront>();
      prepare(context_, wavefront.get());
      trace_through_media(rays, wavefront.get(), &found[i]);
    } else {
      trace(rays, &found[i]);
    }
  });
  std::vector<NextEventProbe> trials;
  for (const std::vector<NextEventProbe>& f : found) trials.insert(trials.end(), f.begin(), f.end());
  return trials;
}

LightMoments NextEventProbes::moments(const std::vector<double>& squares) const {
  const auto at = [&](size_t i) { return squares.begin() + static_cast<ptrdiff_t>(i); };
  LightMoments m;
  m.light.assign(at(0), at(light_count_));
  for (size_t k = 0; k < first_bin_.size(); ++k) m.sky.emplace_back(at(first_bin(k)), at(first_bin(k + 1)));
  return m;
}

}  // namespace lightmill
