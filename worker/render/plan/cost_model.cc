#include "worker/render/plan/cost_model.h"

#include <cmath>

namespace lightmill {
namespace {

// Microseconds, fitted.
constexpr double kCameraPath = 0.05, kLightPath = 0.06;
constexpr double kBounce = 0.06, kNextEvent_ = 0.03, kConnection = 0.06, kLensConnection = 0.03;
constexpr double kRay = 0.02, kRayPerLevel = 0.008;        // closest hits
constexpr double kShadow = 0.01, kShadowPerLevel = 0.004;  // occlusion

}  // namespace

double sample_cost(const SampleWork& w, const SamplingPlan& plan, double primitives) {
  const double levels = std::log2(primitives + 1);
  const double hit = kBounce + kRay + kRayPerLevel * levels, shadow = kShadow + kShadowPerLevel * levels;
  double cost = 0;
  if (plan.strategies & kCameraLayer) cost += kCameraPath + hit * w.camera_hits;
  if (plan.strategies & kLightPaths) cost += plan.light_paths * (kLightPath + hit * w.light_hits);
  if (plan.strategies & kNextEvent) cost += kNextEvent_ * w.next_events + shadow * w.next_event_rays;
  if (plan.strategies & kVertexConnections)
    cost += plan.connections * (kConnection * w.connections + shadow * w.connection_rays);
  if (plan.strategies & kLensConnections)
    cost += plan.light_paths * (kLensConnection * w.lens_connections + shadow * w.lens_rays);
  return cost;
}

}  // namespace lightmill
