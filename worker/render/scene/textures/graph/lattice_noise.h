#pragma once
// Gradient noise on lattices of one to four dimensions and what is made of it: Perlin's improved noise (2002)
// with the hash and the scales of Cycles, and Musgrave's fractals ("Texturing and Modeling", chapter 16).
#include "common/scene/texture_graph/jenkins_hash.h"
#include "common/scene/texture_graph/texture_graph.h"
#include "worker/render/scene/textures/graph/graph_functions.h"

namespace lightmill::graph {

/// In [0, 1].
template <class F>
inline F unit_hash(UintOf<F> h) {
  // In two parts, so that eight lanes round as one does.
  return (to_float(as_int(h >> 16)) * 65536.0f + to_float(as_int(h & 0xffffu))) * 0x1p-32f;
}

/// The dot product of an offset and the gradient that the hash chooses.
template <int D, class F>
inline F lattice_gradient(UintOf<F> hash, const F* x) {
  const auto signed_by = [&](uint32_t bit, F a) { return select(MaskOf<F>((hash & bit) != 0u), -a, a); };
  if constexpr (D == 1) return signed_by(8, x[0] * (to_float(as_int(hash & 7u)) + 1.0f));
  if constexpr (D == 2) {
    const MaskOf<F> low = MaskOf<F>(as_int(hash & 7u) < 4);
    return signed_by(1, select(low, x[0], x[1])) + signed_by(2, select(low, x[1], x[0]) * 2.0f);
  }
  if constexpr (D == 3) {
    const IntOf<F> h = as_int(hash & 15u);
    const F u = select(MaskOf<F>(h < 8), x[0], x[1]);
    const F other = select(mask_or(MaskOf<F>(h == 12), MaskOf<F>(h == 14)), x[0], x[2]);
    return signed_by(1, u) + signed_by(2, select(MaskOf<F>(h < 4), x[1], other));
  }
  if constexpr (D == 4) {
    const IntOf<F> h = as_int(hash & 31u);
    const F u = select(MaskOf<F>(h < 24), x[0], x[1]), v = select(MaskOf<F>(h < 16), x[1], x[2]),
            s = select(MaskOf<F>(h < 8), x[2], x[3]);
    return signed_by(1, u) + signed_by(2, v) + signed_by(4, s);
  }
  return F{};
}

/// In [-1, 1] or so, 0 on the lattice.
template <int D, class F>
[[gnu::noinline]] F lattice_noise(const F* at) {
  constexpr float kScales[4] = {0.25f, 0.6616f, 0.982f, 0.8344f};
  UintOf<F> cell[D];
  F rest[D], weight[D];
  for (int i = 0; i < D; ++i) {
    const F x = usable(at[i]), low = floor(x), t = x - low;
    cell[i] = as_uint(to_int(low));
    rest[i] = t;
    weight[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  }
  F value[1 << D];
  for (int corner = 0; corner < 1 << D; ++corner) {
    UintOf<F> c[4]{};
    F x[D];
    for (int i = 0; i < D; ++i) {
      const int far = corner >> i & 1;
      c[i] = cell[i] + static_cast<uint32_t>(far);
      x[i] = rest[i] - static_cast<float>(far);
    }
    value[corner] = lattice_gradient<D, F>(jenkins_hash_words(D, c[0], c[1], c[2], c[3]), x);
  }
  for (int i = 0; i < D; ++i) {
    for (int k = 0; k < 1 << (D - 1 - i); ++k) value[k] = blend(value[2 * k], value[2 * k + 1], weight[i]);
  }
  return value[0] * kScales[D - 1];
}

constexpr float kMostDetail = 15;

template <int D, class F>
inline F noise_at(const F* x, F frequency) {
  F p[D];
  for (int i = 0; i < D; ++i) p[i] = x[i] * frequency;
  return lattice_noise<D, F>(p);
}

/// Octaves of noise in [0, 1], averaged; the last one in part where `detail` is not whole.
template <int D, class F>
[[gnu::noinline]] F fractal_noise(const F* x, F detail, F roughness) {
  const F octaves = clamp(detail, 0.0f, kMostDetail), part = octaves - floor(octaves);
  const F gain = clamp(roughness, 0.0f, 1.0f);
  F sum{}, most{}, amplitude = splat<F>(1.0f), frequency = splat<F>(1.0f), out{};
  for (int i = 0;; ++i) {
    const auto number = static_cast<float>(i);
    const MaskOf<F> active = MaskOf<F>(octaves + 1.0f > number);
    if (!any(active)) return out;
    const F t = noise_at<D>(x, frequency) * 0.5f + 0.5f;
    const F more = sum + t * amplitude, weight = most + amplitude;
    const MaskOf<F> whole = MaskOf<F>(octaves >= number);
    const F partly = blend(sum / select(MaskOf<F>(most == 0.0f), splat<F>(1.0f), most), more / weight, part);
    out = select(active, select(whole, more / weight, partly), out);
    sum = select(whole, more, sum), most = select(whole, weight, most);
    amplitude = amplitude * gain;
    frequency = frequency * 2.0f;
  }
}

/// Musgrave's fractals over signed noise.
template <int D, class F>
[[gnu::noinline]] F musgrave(MusgraveKind kind, const F* x, const F operand[5]) {
  const F octaves = clamp(operand[0], 0.0f, kMostDetail), dimension = max(operand[1], splat<F>(1e-5f)),
          lacunarity = max(operand[2], splat<F>(1e-5f)), offset = operand[3], gain = operand[4];
  const F part = octaves - floor(octaves), fall = power(lacunarity, -dimension);
  const F one = splat<F>(1.0f);
  // The last octave counts in part; octaves beyond it do not.
  const auto share = [&](int i) { return clamp(octaves - static_cast<float>(i), 0.0f, 1.0f); };
  F frequency = one, power_of_fall = one;
  const auto step = [&] { frequency = frequency * lacunarity, power_of_fall = power_of_fall * fall; };
  // Lanes that are done stay as they are, whatever others go on with.
  const auto where = [](F part_of, F yes, F no) { return select(MaskOf<F>(part_of > 0.0f), yes, no); };
  const auto running = [&](int i) { return any(MaskOf<F>(octaves > static_cast<float>(i))); };
  switch (kind) {
    case MusgraveKind::kFbm: {
      F value{};
      for (int i = 0; running(i); ++i, step())
        value = where(share(i), value + share(i) * noise_at<D>(x, frequency) * power_of_fall, value);
      return value;
    }
    case MusgraveKind::kMultifractal: {
      F value = one;
      for (int i = 0; running(i); ++i, step()) {
        const F factor = share(i) * power_of_fall * noise_at<D>(x, frequency) + 1.0f;
        value = where(share(i), value * factor, value);
      }
      return value;
    }
    case MusgraveKind::kHeteroTerrain: {
      F value = offset + noise_at<D>(x, frequency);
      step();
      // Part of an octave comes after all whole ones, of which the first stands above.
      const F after = max(floor(octaves), one);
      for (int i = 1; i <= 15; ++i, step()) {
        const auto number = static_cast<float>(i);
        const MaskOf<F> whole = MaskOf<F>(floor(octaves) > number), partly = MaskOf<F>(after == number);
        const F s = select(whole, one, select(partly, part, F{}));
        if (!any(MaskOf<F>(s > 0.0f))) break;
        const F more = value + s * (noise_at<D>(x, frequency) + offset) * power_of_fall * value;
        value = where(s, more, value);
      }
      return value;
    }
    case MusgraveKind::kHybridMultifractal: {
      F value{}, weight = one;
      for (int i = 0; running(i); ++i, step()) {
        const MaskOf<F> active =
            mask_and(MaskOf<F>(weight > 0.001f), MaskOf<F>(octaves > static_cast<float>(i)));
        if (!any(active)) break;
        weight = min(weight, one);
        const F signal = (noise_at<D>(x, frequency) + offset) * power_of_fall;
        value = select(active, value + share(i) * weight * signal, value);
        weight = select(active, weight * gain * signal, F{});
      }
      return value;
    }
    case MusgraveKind::kRidgedMultifractal: {
      const auto ridge = [&] {
        const F r = offset - abs(noise_at<D>(x, frequency));
        return r * r;
      };
      F signal = ridge(), value = signal;
      step();
      for (int i = 1; any(MaskOf<F>(floor(octaves) > static_cast<float>(i))); ++i, step()) {
        const F weight = clamp(signal * gain, 0.0f, 1.0f);
        signal = ridge() * weight;
        value =
            value + select(MaskOf<F>(floor(octaves) > static_cast<float>(i)), signal * power_of_fall, F{});
      }
      return value;
    }
  }
  return F{};
}

}  // namespace lightmill::graph
