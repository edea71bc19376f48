#pragma once
// The scene plan: what the scene needs, and what the renderer therefore leaves out.
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

/// Light that is missing, as missing_light.h says, over all light of the image that is found. Estimates:
/// about a tenth off, and more where it is little.
struct MissingShare {
  double all = 0;
  double never = 0;   // of lights that no path hits
  double seldom = 0;  // by emitter hits that are each brighter than the whole image at one sample per pixel
  double emitter_hits = 0;  // number of the latter, per camera path
  double noise = 0;  // of all such hits: variance of a camera path, over the square of the image's mean

  MissingShare& operator+=(const MissingShare& o) {
    all += o.all, never += o.never, seldom += o.seldom, emitter_hits += o.emitter_hits, noise += o.noise;
    return *this;
  }
};

struct ScenePlan {
  std::vector<PlanItem> items;
  /// Exponent of the exact sums' quantum, of normalised light (radiance_scale.h).
  int quantum_exponent = 0;
  /// Families of strategies that the scene allows, and those of them that can add light at all.
  Strategies possible = kAllStrategies, useful = kAllStrategies;
  /// For every set of families, by its value: whether it finds all light that the possible ones find.
  std::array<bool, kAllStrategies + 1> complete{};
  /// Says which light the running strategies lose although other possible ones would find it; empty if none
  /// is lost.
  std::string lost_light;
  /// Light that no strategy finds, on paths of at most the depth that is set. The same as a line for people:
  /// empty if it is less than a hundredth.
  MissingShare missing;
  std::string missing_light;
  int64_t primitives = 0;
  /// The least kernels that the scene can do with.
  StageKernels kernels;
};

}  // namespace lightmill
