#pragma once
// Several values of a material in one of its parameters, where ten are too few: floats hold whole numbers of
// 24 bits.
#include <cmath>

#include "worker/render/bsdf/bsdf.h"

namespace lightmill {

inline constexpr float kPackedSteps = 4095, kColorSteps = 255;

/// Two values in [0, 1], in steps of 1/4095.
inline float packed_pair(float a, float b) {
  return static_cast<float>(static_cast<int>(a * kPackedSteps + 0.5f) * 4096 +
                            static_cast<int>(b * kPackedSteps + 0.5f));
}
template <class F>
struct UnpackedPair {
  F first, second;
  UnpackedPair(F packed, MaskOf<F> of_kind) {
    const IntOf<F> pair = to_int(select(of_kind, packed, F{}));
    first = to_float(pair >> 12) * (1 / kPackedSteps);
    second = to_float(pair & 4095) * (1 / kPackedSteps);
  }
};

/// Square roots of the channels, in [0, 1], in steps of 1/255.
inline float packed_color(float r, float g, float b) {
  const auto step = [](float x) { return static_cast<int>(std::sqrt(x) * kColorSteps + 0.5f); };
  return static_cast<float>((step(r) * 256 + step(g)) * 256 + step(b));
}
template <class F>
inline Vec3<F> unpacked_color(F packed, MaskOf<F> of_kind) {
  const IntOf<F> color = to_int(select(of_kind, packed, F{}));
  const auto channel = [](IntOf<F> x) {
    const F root = to_float(x & 255) * (1 / kColorSteps);
    return root * root;
  };
  return {channel(color >> 16), channel(color >> 8), channel(color)};
}

/// Three values in [0, 1], in steps of 1/255.
inline float packed_triple(float a, float b, float c) {
  const auto step = [](float x) { return static_cast<int>(x * kColorSteps + 0.5f); };
  return static_cast<float>((step(a) * 256 + step(b)) * 256 + step(c));
}
template <class F>
struct UnpackedTriple {
  F first, second, third;
  UnpackedTriple(F packed, MaskOf<F> of_kind) {
    const IntOf<F> triple = to_int(select(of_kind, packed, F{}));
    first = to_float(triple >> 16) * (1 / kColorSteps);
    second = to_float((triple >> 8) & 255) * (1 / kColorSteps);
    third = to_float(triple & 255) * (1 / kColorSteps);
  }
};

/// Whole steps beside a fraction, as a roughness alpha, which is above 0 and below 1.
template <class F>
struct UnpackedSteps {
  F steps, fraction;
  UnpackedSteps(F packed, MaskOf<F> of_kind) {
    const F mixed = select(of_kind, packed, splat<F>(0.5f));
    steps = to_float(to_int(mixed));
    fraction = mixed - steps;
  }
};

/// f0 of the channels and f90, which are in parameters 3 and 4, to where metallic_roughness.h has them.
template <class F>
inline void unpack_specular(const BsdfParams<F>& params, MaskOf<F> of_kind, BsdfParams<F>* base) {
  const UnpackedPair<F> red_green(params.p[3], of_kind), blue_f90(params.p[4], of_kind);
  base->p[3] = red_green.first;
  base->p[4] = red_green.second;
  base->p[5] = blue_f90.first;
  base->p[7] = blue_f90.second;
}

}  // namespace lightmill
