#include "worker/render/plan/cost_model.h"

#include <cmath>

namespace lightmill {
namespace {

// Microseconds. A surface hit includes its ray, whose traversal goes with the depth of the tree, and the
// BSDF; a shadow ray is cast for some of the tries, which are what the strategies evaluate; a hit that is
// connected at all is made ready for it once. Scenes of few primitives, which have no tree, lie on the same
// line.
//
// Between the plans of a scene, which is what a choice needs, they hold within 4 % (rms; at most 16 %) on
// eleven scenes and twelve plans (tests/bench/cost_model). Scenes as wholes lie 0.5 to 2.1 times
// beside them, by what they are made of, more where a medium is walked through: all plans of a scene alike,
// so that a cost for each kind of material would change no choice.
constexpr double kCameraPath = 0, kLightPath = 0.0460;
constexpr double kHit = 0.0354, kHitPerLevel = 0.0063;
/// A step through a body, with its ray: by what a scene costs more than with diffuse surfaces in their place.
constexpr double kBodyStep = 0.116;
constexpr double kShadow = 0.0005, kShadowPerLevel = 0.0054;
constexpr double kNextEventTry = 0.0409, kConnectingHit = 0.0149, kConnectionTry = 0.0105, kLensTry = 0.0232,
                 kSplatPixel = 0.0201;

double hit_cost(const SampleWork& w) { return kHit + kHitPerLevel * std::log2(w.primitives + 1); }
double step_cost(const SampleWork& w) { return kBodyStep + kHitPerLevel * std::log2(w.primitives + 1); }
double shadow_cost(const SampleWork& w) { return kShadow + kShadowPerLevel * std::log2(w.primitives + 1); }
/// Filters of more than one pixel share what arrives out.
double lens_ray_cost(const SampleWork& w) {
  return shadow_cost(w) + kSplatPixel * (w.splat_pixels > 1 ? w.splat_pixels : 0);
}

}  // namespace

double camera_cost(const SampleWork& w, const SamplingPlan& plan) {
  double cost = 0;
  if (plan.strategies & kCameraLayer)
    cost += kCameraPath + hit_cost(w) * w.camera_hits + step_cost(w) * w.camera_steps;
  if (plan.strategies & kNextEvent)
    cost += kNextEventTry * w.next_event_tries + shadow_cost(w) * w.next_event_rays;
  if (plan.strategies & kVertexConnections) {
    cost += kConnectingHit * w.camera_hits +
            plan.connections * (kConnectionTry * w.connection_tries + shadow_cost(w) * w.connection_rays);
  }
  return cost;
}

double sample_cost(const SampleWork& w, const SamplingPlan& plan) {
  double cost = camera_cost(w, plan);
  if (plan.strategies & kLightPaths)
    cost += plan.light_paths * (kLightPath + hit_cost(w) * w.light_hits + step_cost(w) * w.light_steps);
  if (plan.strategies & kLightTracing)
    cost += plan.light_paths * (kLensTry * w.lens_tries + lens_ray_cost(w) * w.lens_rays);
  return cost;
}

double shadow_rays(const SampleWork& w, const SamplingPlan& plan) {
  double rays = 0;
  if (plan.strategies & kNextEvent) rays += w.next_event_rays;
  if (plan.strategies & kVertexConnections) rays += plan.connections * w.connection_rays;
  if (plan.strategies & kLightTracing) rays += plan.light_paths * w.lens_rays;
  return rays;
}

}  // namespace lightmill
