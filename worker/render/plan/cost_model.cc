#include "worker/render/plan/cost_model.h"

#include <cmath>

namespace lightmill {
namespace {

// Microseconds. A surface hit includes its ray, whose traversal goes with the depth of the tree, and the
// BSDF; a shadow ray is cast for some of the tries, which are what the strategies evaluate; a hit that is
// connected at all is made ready for it once. Scenes of few primitives, which have no tree, lie on the same
// line.
//
// Between the plans of a scene, which is what a choice needs, they hold within 3 % (rms; at most 16 %) on
// eleven scenes and 27 plans (tests/bench/cost_model, plan_check). Scenes as wholes lie 0.5 to 2.1 times
// beside them, by what they are made of, more where a medium is walked through: all plans of a scene alike,
// so that a cost for each kind of material would change no choice.
constexpr double kCameraPath = 0, kLightPath = 0.0425;
constexpr double kHit = 0.121, kHitPerLevel = 0.0029;
constexpr double kShadow = 0.0111, kShadowPerLevel = 0.0044;
constexpr double kNextEventTry = 0.0188, kConnectingHit = 0.0236, kConnectionTry = 0.0137, kLensTry = 0.0355;

double hit_cost(const SampleWork& w) { return kHit + kHitPerLevel * std::log2(w.primitives + 1); }
double shadow_cost(const SampleWork& w) { return kShadow + kShadowPerLevel * std::log2(w.primitives + 1); }

}  // namespace

double camera_cost(const SampleWork& w, const SamplingPlan& plan) {
  double cost = 0;
  if (plan.strategies & kCameraLayer) cost += kCameraPath + hit_cost(w) * w.camera_hits;
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
  if (plan.strategies & kLightPaths) cost += plan.light_paths * (kLightPath + hit_cost(w) * w.light_hits);
  if (plan.strategies & kLensConnections)
    cost += plan.light_paths * (kLensTry * w.lens_tries + shadow_cost(w) * w.lens_rays);
  return cost;
}

double shadow_rays(const SampleWork& w, const SamplingPlan& plan) {
  double rays = 0;
  if (plan.strategies & kNextEvent) rays += w.next_event_rays;
  if (plan.strategies & kVertexConnections) rays += plan.connections * w.connection_rays;
  if (plan.strategies & kLensConnections) rays += plan.light_paths * w.lens_rays;
  return rays;
}

}  // namespace lightmill
