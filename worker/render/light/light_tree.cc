// Going down the light tree.
#include "worker/render/light/light_tree.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace lightmill {
namespace {

/// Cosine bounds below this count as this: near the horizon bounds are poor.
constexpr float kLeastCosine = 1.0f / 64;
/// No child that can contribute gets less than this: another may be hidden.
constexpr float kLeastShare = 1.0f / 1024;
/// Least squared distance in the normalised space, weight and probability: far beyond what any image shows,
/// still within float.
constexpr float kLeastDistance2 = 0x1p-80f, kLeastWeight = 1e-36f, kLeastProbability = 1e-36f;

/// x[0], x[0] + x[1], ... in a fixed order.
Float8 running_sum(const Float8& x) {
  Float8 s = x + __builtin_shufflevector(x, Float8{}, 8, 0, 1, 2, 3, 4, 5, 6);
  s = s + __builtin_shufflevector(s, Float8{}, 8, 8, 0, 1, 2, 3, 4, 5);
  return s + __builtin_shufflevector(s, Float8{}, 8, 8, 8, 8, 0, 1, 2, 3);
}

}  // namespace

Float8 LightTree::shares(const Node& n, const Vec3<float>& p) {
  using F = Float8;
  const F one = splat<F>(1.0f), zero{};
  const F dx = p.x - n.x, dy = p.y - n.y, dz = p.z - n.z;
  const F d2 = dx * dx + dy * dy + dz * dz, radius2 = n.radius * n.radius;
  const F inv_d = sqrt(1.0f / max(d2, kLeastDistance2));
  const Int8 inside = d2 <= radius2;
  const F along = (n.ax * dx + n.ay * dy + n.az * dz) * inv_d;
  const F cos_axis = clamp(select(Int8(n.two_sided > 0.0f), abs(along), along), -1.0f, 1.0f);
  const F sin_axis = sqrt(1.0f - cos_axis * cos_axis);
  // The least angle between the axis of a light in the child and the direction from it to p is
  // max(0, angle to the cone's axis - cone - angle under which the sphere is seen): here its cosine.
  const Int8 in_cone = cos_axis >= n.cos_cone;
  const F cos_off = select(in_cone, one, cos_axis * n.cos_cone + sin_axis * n.sin_cone);
  const F sin_off = select(in_cone, zero, sin_axis * n.cos_cone - cos_axis * n.sin_cone);
  const F sin_seen = min(n.radius * inv_d, one);
  const F cos_seen = sqrt(1.0f - sin_seen * sin_seen);
  const F cos_least = select(Int8(cos_off >= cos_seen), one, cos_off * cos_seen + sin_off * sin_seen);
  const F cosine = select(inside, one, cos_least);
  const F w = n.intensity * max(cosine, kLeastCosine) / max(max(d2, radius2), kLeastDistance2);
  const Int8 shines = (cosine > n.cos_emission) & (n.intensity > 0.0f);
  F weight = select(shines, max(w, kLeastWeight), zero);
  // Where nothing shines it does not matter what is chosen, but something must be.
  if (!any(Int8(weight > 0.0f))) weight = n.intensity;
  const auto sum = [](const F& x) {
    return ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
  };
  return select(Int8(weight > 0.0f), max(weight * (1.0f / sum(weight)), kLeastShare), zero);
}

void LightTree::sample(const Vec3<float>* p, const double* u, unsigned lanes, Choice* choice) const {
  int32_t at[8] = {};
  double rest[8], probability[8];
  for (int l = 0; l < 8; ++l) {
    rest[l] = lanes >> l & 1 ? u[l] : 0;
    probability[l] = 1;
  }
  // All lanes go down a level at a time: their chains of dependent operations overlap.
  while (lanes != 0) {
    for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
      const auto l = static_cast<size_t>(std::countr_zero(bits));
      const Node& n = nodes_[static_cast<size_t>(at[l])];
      const Float8 share = shares(n, p[l]), end = running_sum(share);
      float ends[9] = {0};
      store(ends + 1, end);
      const double total = double{ends[8]}, x = rest[l] * total;
      // The first child that ends beyond x; it has a share, or it would not end beyond the one before.
      const unsigned before =
          mask_bits(Int8(end <= std::min(static_cast<float>(x), ends[8] * (1 - 0x1p-23f))));
      const auto i = static_cast<size_t>(std::popcount(before));
      const double size = double{ends[i + 1]} - double{ends[i]};
      probability[l] *= size / total;
      rest[l] = std::clamp((x - double{ends[i]}) / size, 0.0, 1 - 0x1p-53);
      at[l] = n.child[i];
      if (at[l] < 0) {
        choice[l] = {~at[l], std::max(static_cast<float>(probability[l]), kLeastProbability)};
        lanes &= ~(1u << l);
      }
    }
  }
}

void LightTree::probability(const Vec3<float>* p, const int32_t* light, unsigned lanes, float* result) const {
  uint64_t trail[8] = {};
  int32_t at[8] = {};
  double probability[8];
  for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
    const auto l = static_cast<size_t>(std::countr_zero(bits));
    trail[l] = trail_[static_cast<size_t>(light[l])];
    probability[l] = 1;
    if (trail[l] == 0) {
      result[l] = 0;
      lanes &= ~(1u << l);
    }
  }
  while (lanes != 0) {
    for (unsigned bits = lanes; bits != 0; bits &= bits - 1) {
      const auto l = static_cast<size_t>(std::countr_zero(bits));
      const Node& n = nodes_[static_cast<size_t>(at[l])];
      float ends[9] = {0};
      store(ends + 1, running_sum(shares(n, p[l])));
      const size_t i = (trail[l] & 15) - 1;
      probability[l] *= (double{ends[i + 1]} - double{ends[i]}) / double{ends[8]};
      at[l] = n.child[i];
      trail[l] >>= 4;
      if (trail[l] == 0 || !(probability[l] > 0)) {
        result[l] = probability[l] > 0 ? std::max(static_cast<float>(probability[l]), kLeastProbability) : 0;
        lanes &= ~(1u << l);
      }
    }
  }
}

}  // namespace lightmill
