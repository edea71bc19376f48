#pragma once
// The scene plan: what the renderer found out the scene needs, and what it therefore leaves out.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/job/features.h"
#include "worker/render/pipeline/kernel_set.h"

namespace lightmill {

struct PlanItem {
  std::string feature;  // e.g. "textures"
  bool needed = false;
  std::string reason;        // why it is needed, or why it can be left out
  std::string saving;        // what leaving it out saves; empty if needed
  Features feature_bit = 0;  // what --plan-override calls it; 0 if it can't be switched
};

/// Light that comes as missing_light.h says, over all light of the image, as far as it is found. Estimates: a
/// tenth off or so, and more where it is little.
struct MissingShare {
  double all = 0;
  double never = 0;     // of lights that no path meets
  double seldom = 0;    // by meetings that are each brighter than the whole image at one sample per pixel
  double meetings = 0;  // of the latter, per camera path
  double noise = 0;     // of all meetings: variance of a camera path, over the square of the image's mean

  MissingShare& operator+=(const MissingShare& o) {
    all += o.all, never += o.never, seldom += o.seldom, meetings += o.meetings, noise += o.noise;
    return *this;
  }
};

struct ScenePlan {
  std::vector<PlanItem> items;
  /// Exponent of the exact sums' quantum: floor(log2(scale of the lights' radiance)) + 1 -
  /// kQuantumBitsBelowScale.
  int quantum_exponent = 0;
  /// Strategy families that the scene allows, and those of them that can add light at all.
  Strategies possible = kAllStrategies, useful = kAllStrategies;
  /// For every set of families, by its value: whether it finds all light that the possible ones find.
  std::array<bool, kAllStrategies + 1> complete{};
  /// Light that what runs does not find although others of the kind would, a line for people; empty if there
  /// is none.
  std::string lost_light;
  /// Light that is missing whatever runs, at most depth of paths, and the same for people; empty if that is
  /// less than a hundredth.
  MissingShare missing;
  std::string missing_light;
  int64_t primitives = 0;
  /// The least that the scene can do with.
  StageKernels kernels;
};

}  // namespace lightmill
