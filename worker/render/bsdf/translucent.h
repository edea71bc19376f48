#pragma once
// glTF's metallic-roughness material over a base of which a share passes light on, diffusely and in a colour
// of its own, to the other side (KHR_materials_diffuse_transmission); with a coat on both sides that may be
// none. Of what the specular lobe leaves (metallic_roughness.h) the base reflects and transmits together no
// more than it gets; transmission is reciprocal as the base's reflection is, and no index changes across it.
//
// Parameters: 0-2 as metallic_roughness.h, 3 f0 of red and green, 4 f0 of blue and f90, 5 the coat, 6 whole
// steps of the dielectric's largest f0 beside alpha, 7-9 what is transmitted / (1 - mean E).
#include "worker/render/bsdf/metallic_roughness.h"
#include "worker/render/bsdf/packed_params.h"

namespace lightmill {

inline constexpr float kBrightestSteps = 4096;
/// The largest f0 as it is stored.
inline float stored_brightest(float f0) {
  return static_cast<float>(static_cast<int>(f0 * kBrightestSteps + 0.5f)) / kBrightestSteps;
}

template <class F>
struct TranslucentParams {
  BsdfParams<F> base;  // as of the opaque material
  Translucence<F> translucence;

  TranslucentParams(const BsdfParams<F>& params, MaskOf<F> of_kind) : base(params) {
    unpack_specular(params, of_kind, &base);
    const UnpackedSteps<F> brightest(params.p[6], of_kind);
    base.p[6] = brightest.fraction;
    base.p[8] = brightest.steps * (1 / kBrightestSteps);
    base.p[9] = params.p[5];
    const F through = max_component(params.rgb(7)), back = max_component(params.rgb(0));
    translucence = {params.rgb(7), through / max(through + back, splat<F>(1e-12f))};
  }
  MetallicRoughness<F, true> material(MaskOf<F> of_kind) const {
    MetallicRoughness<F, true> m(base, of_kind);
    m.translucence = &translucence;
    return m;
  }
};

template <class F>
inline BsdfEval<F> eval_translucent(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                    const Vec3<F>& wi) {
  const TranslucentParams<F> translucent(params, of_kind);
  const MetallicRoughness<F, true> m = translucent.material(of_kind);
  return m.eval(m.side(wo), m.side(wi), wo, wi);
}

template <class F>
inline BsdfSample<F> sample_translucent(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                        F u, F v) {
  const TranslucentParams<F> translucent(params, of_kind);
  return sample_metallic_roughness(translucent.material(of_kind), wo, u, v);
}

}  // namespace lightmill
