#pragma once
// glTF's metallic-roughness material with a specular lobe that is wider along a direction of the surface
// (KHR_materials_anisotropy), and a coat that may be none. There are no tables of such lobes: energy is
// compensated as for the narrower of the two widths, and the base gets what the larger of the round lobes of
// either width leaves, so that some light is lost and none is made.
//
// Parameters: 0-2 as metallic_roughness.h, 3 f0 of red and green, 4 f0 of blue and f90, 5 the coat, 6 alpha
// along the direction, 7 the largest f0 of the dielectric, 8 alpha across, 9 the direction within Frame(ns),
// in turns.
#include "worker/render/bsdf/metallic_roughness.h"
#include "worker/render/bsdf/packed_params.h"

namespace lightmill {

template <class F>
struct BrushedParams {
  BsdfParams<F> base;  // as of the round material
  AnisotropicGgx<F> ggx;
  LobeAxes<F> axes;

  BrushedParams(const BsdfParams<F>& params, MaskOf<F> of_kind) : base(params), axes(params.p[9]) {
    unpack_specular(params, of_kind, &base);
    ggx = {select(of_kind, params.p[6], splat<F>(1.0f)), select(of_kind, params.p[8], splat<F>(1.0f))};
    base.p[6] = ggx.alpha_y;  // never the wider one
    base.p[8] = params.p[7];
    base.p[9] = params.p[5];
  }
  MetallicRoughness<F, true, AnisotropicGgx<F>> material(MaskOf<F> of_kind) const {
    return {base, of_kind, ggx, nullptr, nullptr};
  }
};

template <class F>
inline BsdfEval<F> eval_brushed(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                const Vec3<F>& wi) {
  const BrushedParams<F> brushed(params, of_kind);
  const auto m = brushed.material(of_kind);
  const Vec3<F> o = brushed.axes.to_lobe(wo), i = brushed.axes.to_lobe(wi);
  return m.eval(m.side(o), m.side(i), o, i);
}

template <class F>
inline BsdfSample<F> sample_brushed(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                    F v) {
  const BrushedParams<F> brushed(params, of_kind);
  BsdfSample<F> s = sample_metallic_roughness(brushed.material(of_kind), brushed.axes.to_lobe(wo), u, v);
  s.wi = brushed.axes.from_lobe(s.wi);
  return s;
}

}  // namespace lightmill
