#pragma once
// What the pilot of a render with the integrator `auto` found out, and the plan that it chose.
#include <cstdint>
#include <string>
#include <vector>

#include "common/job/sampling_plan.h"

namespace lightmill {

/// Work of one camera path, with all that belongs to it, under the plan of the pilot: every strategy, one
/// light path, one connection.
struct SampleWork {
  double camera_hits = 0, light_hits = 0;  // surface hits of camera paths and of light paths
  double next_event_rays = 0, connection_rays = 0, lens_rays = 0;  // shadow rays
  double primitives = 0;                                           // of the scene: what rays are cast into
  // What the strategies evaluated, of which the rays are what was not zero nor lost to roulette.
  double next_event_tries = 0, connection_tries = 0, lens_tries = 0;
  double splat_pixels = 0;  // of the pixel filter: to how many pixels a splat goes; of older reports 0
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

/// What the scene needs of the renderer, or does without; as lightmill explain prints it.
struct FeatureNote {
  std::string feature;
  bool needed = false;
  std::string reason;
  std::string saving;  // of leaving it out; empty if it is needed
  bool operator==(const FeatureNote&) const = default;
};

struct PilotReport {
  SamplingPlan chosen;
  std::vector<PlanEstimate> estimates;  // of every plan considered, `chosen` included; uniform effort
  int64_t samples = 0;                  // camera paths that the pilot traced
  SampleWork work;
  double adaptive_gain = 1;  // predicted of the chosen effort: times less variance x cost
  double emission_guide_gain = 1;    // of light paths that are aimed over those that are not; 1 where that was clear
  std::vector<FeatureNote> features = {};  // under the chosen plan; of reports before there were any none
  std::vector<std::string> missing_light = {};  // what light the image will lack, a line each, for people
};

/// At most so many lines tell of missing light; a text has at most so many bytes.
inline constexpr size_t kMaxMissingLight = 8, kMaxNoteBytes = 2000;

/// Largest accepted JSON of a report, bytes.
inline constexpr size_t kMaxPilotBytes = size_t{1} << 20;

std::string pilot_to_json(const PilotReport& report);
/// Inverse. Throws Error(kUsage) if it is malformed, too large, or a value is out of range.
PilotReport pilot_from_json(const std::string& json);

}  // namespace lightmill
