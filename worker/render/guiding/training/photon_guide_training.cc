#include "worker/render/guiding/training/photon_guide_training.h"

#include <array>
#include <cmath>

#include "worker/render/guiding/training/photon_guide_trial.h"
#include "worker/render/guiding/training/photon_tracing.h"

namespace lightmill {
namespace {

/// A preview pass: light paths that are followed, a wavefront at a time, and camera paths of its trial; at
/// most, and per pixel of an image so small that they would take longer than it.
struct TracedPhotons {
  int64_t light_paths, per_pixel, camera_paths;
};
/// The second pass goes on where the first has ended, unless that shows nothing.
constexpr TracedPhotons kFirst{int64_t{1} << 18, 16, int64_t{1} << 15},
    kSecond{int64_t{1} << 23, 256, int64_t{1} << 17};
/// Photons that are enough, looked for in rounds of this many wavefronts.
constexpr size_t kGuidePhotons = size_t{1} << 17, kPhotonRound = 128;

/// Noise without the guide over that with it, from which on it is used. Paths that go through glass are
/// longer, and staircase2 lost a tenth where 1.17 was predicted.
constexpr double kLeastPhotonGain = 1.3, kLeastGainFirst = 1.15, kNoLoss = 0.97;
/// Least paths of a trial that the guide has led to a light: fewer are chance; a first pass need see some.
/// kRare: how many times fewer without the guide are out of a trial's reach.
constexpr double kLeastLed = 16, kLeastLedFirst = 2, kRare = 100, kRareFirst = 20;
/// Least effective number of these: fewer would be fireflies in place of what is dark without them.
constexpr double kLeastRare = 64, kLeastRareFirst = 4;

using Noise = std::array<double, kGuideShares.size()>;
constexpr size_t kSmallShare = 1, kTriedShare = 2;
static_assert(kGuideShares[kTriedShare] == PhotonGuide{}.share);

/// One half of the trial's noise. It comes of differences, so some may be too small: no density counts as
/// more than this many times what it was.
Noise bounded(const Noise& noise) {
  Noise result{};
  constexpr float kTried = kGuideShares[kTriedShare];
  for (size_t k = 0; k < noise.size(); ++k) {
    const float most = std::max(kGuideShares[k] / kTried, (1 - kGuideShares[k]) / (1 - kTried));
    result[k] = std::max(noise[k], noise[kTriedShare] / double{most});
  }
  return result;
}

/// What share k of kGuideShares gains; nothing if either half shows a loss.
double gain_of(const GuideTrial& trial, size_t k) {
  const Noise first = bounded(trial.noise[0]), second = bounded(trial.noise[1]);
  const double a = first[0] / first[k], b = second[0] / second[k];
  return std::min(a, b) >= kNoLoss ? std::sqrt(a * b) : 0;
}

/// A share of kGuideShares and what it gains; for share 0, what the best one would.
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

/// Whether a first preview pass is worth a second.
bool promises(const GuideTrial& preview) {
  if (preview.led < kLeastLedFirst || gain_of(preview, kSmallShare) == 0) return false;
  if (best_share(preview).gain >= kLeastGainFirst) return true;
  return preview.led >= kRareFirst * preview.led_unguided && preview.led_effective >= kLeastRareFirst;
}

Choice choose_share(const GuideTrial& trial) {
  const Choice best = best_share(trial);
  if (trial.led < kLeastLed) return {};
  const bool rare = trial.led >= kRare * trial.led_unguided;
  if (rare && trial.led_effective < kLeastRare) return {};
  if (best.gain >= kLeastPhotonGain) return best;
  // The trial can't price what is so rare without the guide: in a long render it is all the noise.
  if (rare && gain_of(trial, kSmallShare) > 0) return {std::max(best.share, kSmallShare), best.gain};
  return {0, best.gain};
}

}  // namespace

void train_photon_guide(const StageContext& context, int threads, RenderScene* scene) {
  // Nothing hits lights at a point, and light paths can't be followed among fibres.
  if (!scene->any_delta || scene->any_fibres || scene->lights.only_delta) return;
  std::vector<Photon> photons;
  const int64_t pixels = context.grid.crop.area();
  const auto wavefronts = [&](const TracedPhotons& preview) {
    return static_cast<size_t>(std::min(preview.light_paths, preview.per_pixel * pixels) / kWavefront);
  };
  const auto try_photons = [&](size_t first, const TracedPhotons& preview) {
    const auto trace = [&](size_t number) {
      return photons_of_wavefront(context, number, PhotonUse::kGuide);
    };
    trace_wavefronts(first, wavefronts(preview), kPhotonRound, kGuidePhotons, threads, trace, &photons);
    scene->caustics = make_photon_guide(photons);
    return scene->caustics.empty() ? GuideTrial() : try_guide(context, preview.camera_paths, threads);
  };
  const GuideTrial preview = try_photons(0, kFirst);
  Choice choice;
  if (promises(preview)) choice = choose_share(try_photons(wavefronts(kFirst), kSecond));
  if (choice.share > 0) {
    scene->caustics.share = kGuideShares[choice.share];
  } else {
    scene->caustics = {};
  }
  scene->caustics.gain = choice.gain;
}

}  // namespace lightmill
