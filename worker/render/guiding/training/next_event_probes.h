#pragma once
// Rays by which next_event_guide_training.h learns what lights add where: from places that camera paths
// reach, to points on lights and into the bins of skies.
#include <cstdint>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/light/light_table.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A place where a camera path met a surface, or collided in a medium.
struct LitPlace {
  Vec3f p, normal;  // on the side that the path came from
  float error = 0;
  bool both_sides = false;  // light from behind counts
  bool scatters = false;    // in a medium: light counts from wherever it comes
  float time = 0;           // of the path
  int32_t media = 0;        // on the sides of `ng` (medium.h); 0 without media
  Vec3f ng;                 // the surface's own
};

/// The vertices up to `depth` of about `paths` camera paths, all over the film.
std::vector<LitPlace> find_places(const StageContext& context, int64_t paths, int depth, int threads);

/// What a ray from a place to a channel adds: the square of a light's irradiance, by a draw of that light; or
/// of a bin's, if all of it is seen.
struct NextEventProbe {
  uint32_t place = 0, channel = 0;
  double square = 0;  // of what float holds
  float chosen = 1;   // of a light: probability of drawing it as without a guide
};

/// Casts the rays. They are sorted by channels: the lights, then the bins of the environments in their order.
/// What media take away of them is estimated as connections are, noise included.
class NextEventProbes {
 public:
  /// `sky_light`: per environment map, the light that has it, or -1 if its bins are no channels. The
  /// arguments must outlive this object. The context's lights have bins, but no guide yet.
  NextEventProbes(const StageContext& context, const std::vector<int32_t>& sky_light);

  size_t channels() const { return channels_.size(); }
  /// Whether draws of lights are among the trials: there must be several lights or a distant one, and not too
  /// many.
  bool draws_lights() const {
    return (light_count_ > 1 || lights_.any_distant) && light_count_ <= size_t{kGuidedLights};
  }
  /// Mean square of such a draw as without a guide, for the lights that have no bins.
  double unguided_square(const std::vector<NextEventProbe>& trials, size_t places) const;
  /// Trials of all places, in their order.
  std::vector<NextEventProbe> run(const std::vector<LitPlace>& places, uint64_t seed, int threads) const;
  /// `squares`: means of all channels.
  LightMoments moments(const std::vector<double>& squares) const;

 private:
  struct Channel {
    size_t map = 0;
    int32_t bin = -1;  // -1: a light
    double light = 0;  // of a bin: radiance x solid angle
  };
  struct Rays;
  class Caster;

  size_t first_bin(size_t map) const { return map < first_bin_.size() ? first_bin_[map] : channels_.size(); }
  /// Whether a light's bins are channels.
  bool has_bins(size_t light) const;
  void preview_around(uint64_t seed, uint32_t index, const LitPlace& place,
                      std::vector<NextEventProbe>* trials, Rays* rays) const;
  void trace(const Rays& rays, std::vector<NextEventProbe>* trials) const;
  void trace_through_media(const Rays& rays, Wavefront* w, std::vector<NextEventProbe>* trials) const;

  const StageContext& context_;
  const LightTable& lights_;
  const size_t light_count_;
  std::vector<Channel> channels_;
  std::vector<size_t> first_bin_;  // per environment map
  std::vector<size_t> lit_;        // channels of bins that shine
};

}  // namespace lightmill
