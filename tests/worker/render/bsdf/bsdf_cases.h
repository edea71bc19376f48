#pragma once
// Every kind of BSDF with several parameters, made by the scene builder as a scene would make them.
#include <string>
#include <vector>

#include "tests/support/statistics.h"
#include "worker/render/bsdf/bsdf_dispatch.h"

namespace lightmill::test {

struct BsdfCase {
  std::string name;
  int32_t kind;
  BsdfParams<float> params;
  float alpha = 0;  // roughness, 0 if smooth

  BsdfEval<float> eval(const Vec3<float>& wo, const Vec3<float>& wi, Mode mode = Mode::kRadiance) const {
    return eval_bsdf<float>(kind, true, params, wo, wi, mode);
  }
  BsdfSample<float> sample(const Vec3<float>& wo, Random& random, Mode mode = Mode::kRadiance) const {
    const float lobe = random.uniform(), u = random.uniform(), v = random.uniform();
    return sample_bsdf<float>(kind, true, params, wo, lobe, u, v, mode);
  }
};

std::vector<BsdfCase> all_bsdfs();
/// Unit direction at polar angle `degrees` (above 90: below the surface).
Vec3<float> direction_at(double degrees, double phi = 0.7);
/// Outgoing directions for tests: from normal to grazing, on both sides.
std::vector<Vec3<float>> outgoing_directions();

}  // namespace lightmill::test
