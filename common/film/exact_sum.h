#pragma once
// Exact, associative sums of non-negative floats: 128-bit fixed point at a fixed scale.
//
// Every contribution (a camera sample's radiance, one splat) is rounded once to a multiple of
// 2^quantum_exponent. From there on sums are integers. So they may be formed in any order and in any stages:
// in a thread, a worker, the coordinator. The quantum is part of the job's plan.
//
//   ExactSum sum;
//   if (auto units = to_units(value, q)) sum.units += *units; else ++refused;
//   double mean = from_units(sum.units, q) / count;
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>

namespace lightmill {

using Units = unsigned __int128;

/// Contributions of 2^kMaxContributionBits units or more are refused, and counted (dropped.h). 2^35 of the
/// largest ones still fit into the sum.
inline constexpr int kMaxContributionBits = 92;
/// The plan puts its radiance scale S (a power of two from the lights, worker/render/plan/) this many bits
/// above the quantum: contributions up to 2^40 S are representable, and steps are S * 2^-52.
inline constexpr int kQuantumBitsBelowScale = 52;

/// Rounds `x` >= 0 to units of 2^quantum_exponent (half up). Empty for NaN, infinity, a negative or a
/// too large value. Bits depend on x and the exponent only.
inline std::optional<Units> to_units(float x, int quantum_exponent) {
  const uint32_t bits = std::bit_cast<uint32_t>(x);
  if (bits == 0 || bits == 0x80000000u) return Units{0};
  if (bits >= 0x7f800000u) return std::nullopt;  // negative (sign bit), infinity or NaN
  const int biased = static_cast<int>(bits >> 23);
  const uint32_t mantissa = biased ? (bits & 0x7fffffu) | 0x800000u : bits & 0x7fffffu;
  const int shift = (biased ? biased : 1) - 150 - quantum_exponent;  // x = mantissa * 2^(shift + quantum)
  if (shift >= 0) {
    if (shift + 24 > kMaxContributionBits) return std::nullopt;
    return Units{mantissa} << shift;
  }
  if (shift < -25) return Units{0};
  return Units{(mantissa + (1u << (-shift - 1))) >> -shift};
}

/// The value of a sum as a double (rounded once).
inline double from_units(Units units, int quantum_exponent) {
  const auto high = static_cast<double>(static_cast<uint64_t>(units >> 64));
  const auto low = static_cast<double>(static_cast<uint64_t>(units));
  return std::ldexp(high * 0x1p64 + low, quantum_exponent);
}

/// RGB sum of one pixel.
struct ExactRgb {
  Units c[3] = {0, 0, 0};
  ExactRgb& operator+=(const ExactRgb& o) {
    for (int i = 0; i < 3; ++i) c[i] += o.c[i];
    return *this;
  }
  bool operator==(const ExactRgb&) const = default;
  bool is_zero() const { return !(c[0] | c[1] | c[2]); }
};

}  // namespace lightmill
