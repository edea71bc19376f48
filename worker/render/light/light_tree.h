#pragma once
// Selects among many lights by what each may contribute at a point: a bounding hierarchy with 8 children a
// node (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; the
// bounds on angles as in pbrt-v4 §12.6.3).
//
// A child is bounded by a sphere, a cone that holds its lights' axes, and an angle of emission around every
// axis. Its weight is intensity x cosine bound / distance^2. It uses nothing of the receiving surface but its
// position: the probability is also needed for light paths and for camera paths that hit an emitter, where
// only the position is known. One vector instruction treats the eight children. The source is the same for
// every lane type of the caller.
#include <cstdint>
#include <vector>

#include "worker/render/math/vec.h"

namespace lightmill {

/// What a light can reach, in normalised space.
struct LightBound {
  int32_t light = 0;             // index in the light table
  double lo[3], hi[3];           // box around its points
  double center[3], radius = 0;  // sphere around them
  double axis[3] = {0, 0, 0};    // unit, or 0: shines everywhere
  double cos_emission = 0;       // of the largest angle between axis and an emitted direction
  bool two_sided = false;        // shines along -axis as well
  double intensity = 0;          // W/sr towards the brightest direction, mean over channels; > 0
};

class LightTree {
 public:
  struct Choice {
    int32_t light = 0;
    float probability = 1;
  };
  /// `light_count`: size of the light table. Lights that are not in the tree have probability 0.
  void build(std::vector<LightBound> lights, int32_t light_count);
  bool empty() const { return nodes_.empty(); }
  /// Chooses a light for each point p[l], with l in the bits of `lanes` (of 8), by the uniform u[l] in [0,
  /// 1).
  void sample(const Vec3<float>* p, const double* u, unsigned lanes, Choice* choice) const;
  /// Probability with which sample() gives light[l] at p[l]. Never 0 for a light that can reach it.
  void probability(const Vec3<float>* p, const int32_t* light, unsigned lanes, float* result) const;

 private:
  /// Eight children, structure of arrays.
  struct Node {
    Float8 x, y, z, radius;
    Float8 ax, ay, az;          // axis of the cone
    Float8 cos_cone, sin_cone;  // its half angle
    Float8 cos_emission;        // less a margin for rounding
    Float8 two_sided;           // 1 or 0
    Float8 intensity;           // 0: no child
    int32_t child[8];           // node, or ~light
  };
  /// Probabilities of the children, up to a common factor near 1.
  static Float8 shares(const Node& node, const Vec3<float>& p);
  int32_t add_node(std::vector<LightBound>& lights, size_t begin, size_t end, uint64_t trail, int depth);

  std::vector<Node> nodes_;
  std::vector<uint64_t> trail_;  // per light: 4 bits a level from the root, child + 1; 0: not in the tree
  double total_intensity_ = 0;
};

}  // namespace lightmill
