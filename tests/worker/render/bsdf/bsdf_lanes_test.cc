// The vector kernels have the bits of the scalar ones, with a kind per lane.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

uint32_t bits(float x) { return float_bits(x); }

TEST(BsdfLanes, EightLanesEqualEightScalars) {
  const auto cases = all_bsdfs();
  Random random(5);
  for (int round = 0; round < 4000; ++round) {
    const Mode mode = round % 2 ? Mode::kRadiance : Mode::kImportance;
    Int8 kind{}, active{};
    BsdfParams<Float8> params;
    params.tables = cases[0].params.tables;  // of all cases
    Vec3<Float8> wo, wi;
    Float8 lobe{}, u{}, v{};
    const BsdfCase* of[8];
    Vec3<float> wos[8], wis[8];
    // Groups of one kind (what the bouncer makes) and mixtures.
    const uint32_t first = random.bits();
    for (int l = 0; l < 8; ++l) {
      of[l] = &cases[(round % 3 ? first + random.bits() % 3 : first) % cases.size()];
      kind[l] = of[l]->kind;
      active[l] = random.bits() % 8 ? -1 : 0;
      for (int i = 0; i < kBsdfParams; ++i) params.p[i][l] = of[l]->params.p[i];
      wos[l] = square_to_sphere(random.uniform(), random.uniform());
      wis[l] = square_to_sphere(random.uniform(), random.uniform());
      wo.x[l] = wos[l].x, wo.y[l] = wos[l].y, wo.z[l] = wos[l].z;
      wi.x[l] = wis[l].x, wi.y[l] = wis[l].y, wi.z[l] = wis[l].z;
      lobe[l] = random.uniform(), u[l] = random.uniform(), v[l] = random.uniform();
    }
    const BsdfEval<Float8> e = eval_bsdf<Float8>(kind, active, params, wo, wi, mode);
    const BsdfSample<Float8> s = sample_bsdf<Float8>(kind, active, params, wo, lobe, u, v, mode);
    for (int l = 0; l < 8; ++l) {
      SCOPED_TRACE(of[l]->name);
      const BsdfEval<float> e1 =
          eval_bsdf<float>(of[l]->kind, active[l], of[l]->params, wos[l], wis[l], mode);
      ASSERT_EQ(bits(e.f.x[l]), bits(e1.f.x));
      ASSERT_EQ(bits(e.f.z[l]), bits(e1.f.z));
      ASSERT_EQ(bits(e.pdf[l]), bits(e1.pdf));
      ASSERT_EQ(bits(e.pdf_reverse[l]), bits(e1.pdf_reverse));
      const BsdfSample<float> s1 =
          sample_bsdf<float>(of[l]->kind, active[l], of[l]->params, wos[l], lobe[l], u[l], v[l], mode);
      ASSERT_EQ(s.valid[l] != 0, s1.valid);
      ASSERT_EQ(s.delta[l] != 0, s1.delta);
      ASSERT_EQ(bits(s.wi.x[l]), bits(s1.wi.x));
      ASSERT_EQ(bits(s.wi.z[l]), bits(s1.wi.z));
      ASSERT_EQ(bits(s.weight.y[l]), bits(s1.weight.y));
      ASSERT_EQ(bits(s.pdf[l]), bits(s1.pdf));
      ASSERT_EQ(bits(s.pdf_reverse[l]), bits(s1.pdf_reverse));
      if (active[l]) {
        ASSERT_EQ(bits(s.roulette_scale[l]), bits(s1.roulette_scale));
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
