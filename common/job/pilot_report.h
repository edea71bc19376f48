#pragma once
// The findings of the pilot of a render with the integrator `auto`, and the plan that it chose.
#include <cstdint>
#include <string>
#include <vector>

#include "common/job/sampling_plan.h"

namespace lightmill {

/// Work of one camera path, with all that belongs to it, under the pilot's plan: every strategy, one light
/// path, one connection.
struct SampleWork {
  double camera_hits = 0, light_hits = 0;  // surface hits of camera paths and of light paths
  double next_event_rays = 0, connection_rays = 0, lens_rays = 0;  // shadow rays
  double primitives = 0;                                           // of the scene: what rays are cast into
  // What the strategies evaluated. Rays are cast for those neither zero nor lost to roulette.
  double next_event_tries = 0, connection_tries = 0, lens_tries = 0;
  double splat_pixels = 0;  // pixels that a splat goes to by the pixel filter; of older reports 0
  double camera_steps = 0, light_steps = 0;  // of walks through bodies; of older reports 0
  SampleWork& operator+=(const SampleWork& o);
  SampleWork times(double factor) const;
};

/// A plan with what the pilot predicts of it.
struct PlanEstimate {
  SamplingPlan plan;
  double relative_variance = 0;  // relMSE of one sample per pixel
  double cost = 0;               // nominal CPU microseconds per sample, from counted work
  double shadow_rays = 0;        // per sample; of older reports 0
};

/// What the scene needs of the renderer, or does without, as `lightmill explain` prints it.
struct FeatureNote {
  std::string feature;
  bool needed = false;
  std::string reason;
  std::string saving;  // of leaving it out; empty if it is needed
  bool operator==(const FeatureNote&) const = default;
};

struct PilotReport {
  SamplingPlan chosen;
  std::vector<PlanEstimate> estimates;  // of every plan considered, `chosen` included; with uniform sampling
  int64_t samples = 0;                  // camera paths that the pilot traced
  SampleWork work;
  double adaptive_gain = 1;        // of the chosen allocation: predicted uniform variance x cost over its own
  double emission_guide_gain = 1;  // variance x cost without it over that with it; 1: not tried
  std::vector<FeatureNote> features = {};  // under the chosen plan; of reports before there were any none
  std::vector<std::string> missing_light = {};  // what light the image will lack, a line each, for people
};

/// Most lines about missing light, and most bytes of a text.
inline constexpr size_t kMaxMissingLight = 8, kMaxNoteBytes = 2000;

/// Largest accepted JSON of a report, bytes.
inline constexpr size_t kMaxPilotBytes = size_t{1} << 20;

std::string pilot_to_json(const PilotReport& report);
/// Inverse. Throws Error(kUsage) if it is malformed, too large, or a value is out of range.
PilotReport pilot_from_json(const std::string& json);

}  // namespace lightmill
