#include "worker/render/plan/caustic_learning.h"

#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "common/parallel.h"
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/producer.h"
#include "worker/render/plan/guide_trial.h"

namespace lightmill {
namespace {

/// A look: light paths that are followed, a wavefront at a time, and camera paths of its trial; at most, and
/// per pixel of an image so small that they would take longer than it.
struct Look {
  int64_t light_paths, per_pixel, camera_paths;
};
/// If the first shows nothing, there is no second, which goes on where the first has ended.
constexpr Look kFirst{int64_t{1} << 18, 16, int64_t{1} << 15},
    kSecond{int64_t{1} << 21, 64, int64_t{1} << 17};
/// Enough photons, which are looked for in rounds of so many wavefronts.
constexpr size_t kPhotons = size_t{1} << 17, kRound = 128;
constexpr int kDepth = 12;
constexpr uint64_t kSeed = 0x63617573;

/// Noise without the guide over with it from which on it is taken; paths that go through glass are longer.
constexpr double kLeastGain = 1.15, kLeastGainFirst = 1.03, kNoLoss = 0.97;
/// Of a trial's paths that the guide has led to a light: fewer are chance; a first look need see some. And
/// how many times as many as without it are out of a trial's reach.
constexpr double kLeastLed = 16, kLeastLedFirst = 2, kRare = 100, kRareFirst = 20;

/// Throws away nothing but photons that are no use: of lights that nothing can hit, and of narrow lobes.
void take_photons(const std::vector<Vertex>& vertices, std::vector<Photon>* photons) {
  for (const Vertex& v : vertices) {
    const float* t = &v.f[Vertex::kThroughput];
    const float power = (t[0] + t[1] + t[2]) / 3;
    // dVC is 0 where nothing can hit the light.
    if (!is_guided(std::bit_cast<int32_t>(v.f[Vertex::kKind])) || !(v.f[Vertex::kDvc] > 0)) continue;
    if (!(power > 0 && std::isfinite(power))) continue;
    Photon& photon = photons->emplace_back();
    photon.p = {v.f[Vertex::kP], v.f[Vertex::kP + 1], v.f[Vertex::kP + 2]};
    photon.power = power;
    sphere_to_square(Vec3<float>{v.f[Vertex::kWo], v.f[Vertex::kWo + 1], v.f[Vertex::kWo + 2]}, &photon.x,
                     &photon.y);
  }
}

/// The light paths of one wavefront.
std::vector<Photon> follow(const StageContext& context, size_t number) {
  const auto wavefront = std::make_unique<Wavefront>();
  Wavefront& w = *wavefront;
  prepare(context, &w);
  LayerContext layer;
  layer.light_key = stream_key(kSeed, kLightStream, 0, 0);
  layer.light_paths = static_cast<int>(kSecond.light_paths);
  layer.first_light_path = static_cast<int>(number) * kWavefront;
  std::vector<Photon> photons;
  produce_light_paths(context, layer, w);
  for (int depth = 1; w.paths.active_count > 0 && depth <= kDepth; ++depth) {
    w.light_vertices.clear();
    cast_light_paths(context, layer, depth, w);
    bounce_light_paths(context, layer, depth, w);
    if (depth > 1) take_photons(w.light_vertices, &photons);
    // What can be joined ends the path.
    std::array<bool, kWavefront> ends{};
    for (const Vertex& v : w.light_vertices) ends[static_cast<size_t>(v.path())] = true;
    int left = 0;
    for (int i = 0; i < w.paths.active_count; ++i) {
      const int32_t slot = w.paths.active[i];
      if (!ends[static_cast<size_t>(slot)]) w.paths.active[left++] = slot;
    }
    w.paths.active_count = left;
  }
  return photons;
}

/// Adds those of wavefronts first, first + 1, ... up to `last`.
void find_photons(StageContext context, size_t first, size_t last, int threads,
                  std::vector<Photon>* photons) {
  // What light paths need to know whether camera paths could make them.
  context.strategies = kEmissionHits | kNextEvent | kVertexConnections;
  context.max_depth = kDepth;
  for (; first < last && photons->size() < kPhotons; first += kRound) {
    std::vector<std::vector<Photon>> found(std::min(kRound, last - first));
    parallel_for(found.size(), threads, [&](size_t i) { found[i] = follow(context, first + i); });
    for (const std::vector<Photon>& f : found) photons->insert(photons->end(), f.begin(), f.end());
  }
}

using Noise = std::array<double, kGuideShares.size()>;
constexpr size_t kSmallShare = 1, kTriedShare = 2;
static_assert(kGuideShares[kTriedShare] == CausticGuide{}.share);

/// A half of the trial's noise. It comes of differences, so that some may be too small: no density is more
/// than so many times what it was.
Noise bounded(const Noise& noise) {
  Noise result{};
  constexpr float kTried = kGuideShares[kTriedShare];
  for (size_t k = 0; k < noise.size(); ++k) {
    const float most = std::max(kGuideShares[k] / kTried, (1 - kGuideShares[k]) / (1 - kTried));
    result[k] = std::max(noise[k], noise[kTriedShare] / double{most});
  }
  return result;
}

/// What share k of kGuideShares gains; nothing where either half shows a loss.
double gain_of(const GuideTrial& trial, size_t k) {
  const Noise first = bounded(trial.noise[0]), second = bounded(trial.noise[1]);
  const double a = first[0] / first[k], b = second[0] / second[k];
  return std::min(a, b) >= kNoLoss ? std::sqrt(a * b) : 0;
}

/// A share of kGuideShares and what it gains; of share 0, what one would.
struct Choice {
  size_t share = 0;
  double gain = 1;
};

Choice best_share(const GuideTrial& trial) {
  Choice best;
  for (size_t k = 1; k < kGuideShares.size(); ++k) {
    const double gain = gain_of(trial, k);
    if (gain > best.gain) best = {k, gain};
  }
  return best;
}

/// Whether a first look is worth a second.
bool promises(const GuideTrial& look) {
  if (look.led < kLeastLedFirst || gain_of(look, kSmallShare) == 0) return false;
  return best_share(look).gain >= kLeastGainFirst || look.led >= kRareFirst * look.led_unguided;
}

Choice choose_share(const GuideTrial& trial) {
  const Choice best = best_share(trial);
  if (trial.led < kLeastLed) return {};
  if (best.gain >= kLeastGain) return best;
  // The trial can't price what is so rare without the guide: it is all the noise that a long render has.
  if (gain_of(trial, kSmallShare) > 0 && trial.led >= kRare * trial.led_unguided)
    return {std::max(best.share, kSmallShare), best.gain};
  return {0, best.gain};
}

}  // namespace

void learn_caustics(const StageContext& context, int threads, RenderScene* scene) {
  // Nothing hits lights at a point, and light paths can't be followed among fibres.
  if (!scene->any_delta || scene->any_fibres || scene->lights.only_delta) return;
  std::vector<Photon> photons;
  const int64_t pixels = context.grid.crop.area();
  const auto wavefronts = [&](const Look& look) {
    return static_cast<size_t>(std::min(look.light_paths, look.per_pixel * pixels) / kWavefront);
  };
  const auto try_photons = [&](size_t first, const Look& look) {
    find_photons(context, first, wavefronts(look), threads, &photons);
    scene->caustics = make_caustic_guide(photons);
    return scene->caustics.empty() ? GuideTrial() : try_guide(context, look.camera_paths, threads);
  };
  const GuideTrial look = try_photons(0, kFirst);
  Choice choice;
  if (promises(look)) choice = choose_share(try_photons(wavefronts(kFirst), kSecond));
  if (choice.share > 0) {
    scene->caustics.share = kGuideShares[choice.share];
  } else {
    scene->caustics = {};
  }
  scene->caustics.gain = choice.gain;
}

}  // namespace lightmill
