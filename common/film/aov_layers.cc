#include "common/film/aov_layers.h"

#include <algorithm>
#include <cmath>

#include "common/film/signed_sum.h"

namespace lightmill {

namespace {

constexpr int kFractionBits = 30;  // of albedo and normal
constexpr int kLengthBits = 32;    // of normalised space, and of texture coordinates
constexpr int kLengthRange = 20;   // they saturate at 2^kLengthRange, lengths times the scene's extent
constexpr int kPixelBits = 20;     // of motion on the film, and as many above
constexpr int kSquareBits = 60;
static_assert(kNormalBias == Units{2} << kFractionBits);
static_assert(kPositionBias == Units{1} << (kLengthBits + kLengthRange));
static_assert(kMotionBias == Units{1} << (kPixelBits + kPixelBits));

/// x in steps of 2^-bits, rounded half up and saturated at +-2^range; 0 for NaN.
int64_t steps(float x, int bits, int range) {
  if (!(x == x)) return 0;
  const double limit = std::ldexp(1.0, bits + range) - 1;
  return static_cast<int64_t>(std::floor(std::clamp(std::ldexp(double{x}, bits), -limit, limit) + 0.5));
}

double to_double(Units units) { return from_signed_units(units, 0); }

/// sum - bias * count, which may be negative.
double unbiased(Units sum, Units bias, int64_t count) {
  const Units offset = bias * static_cast<Units>(count);
  return sum >= offset ? to_double(sum - offset) : -to_double(offset - sum);
}

}  // namespace

bool needs_layer(Aovs set, int layer) {
  switch (layer) {
    case kAlbedoLayer:
      return set & (kAovAlbedo | kAovSpecularAlbedo);
    case kNormalLayer:
      return set & kAovNormal;
    case kPositionLayer:
      return set & kAovPosition;
    case kDepthLayer:
      return set & (kAovDepth | kAovPosition | kAovAlpha);
    case kDirectLayer:
      return set & (kAovDirect | kAovIndirect);
    case kVarianceLayer:
      return set & kAovVariance;
    case kDiffuseAlbedoLayer:
      return set & (kAovDiffuseAlbedo | kAovSpecularAlbedo);
    case kMotionLayer:
      return set & kAovMotion;
    case kUvLayer:
      return set & kAovUv;
    default:
      return false;
  }
}

Units albedo_units(float x) { return static_cast<Units>(std::max<int64_t>(0, steps(x, kFractionBits, 0))); }
Units normal_units(float x) {
  return static_cast<Units>(static_cast<int64_t>(kNormalBias) + steps(x, kFractionBits, 1));
}
Units position_units(float x) {
  return static_cast<Units>(static_cast<int64_t>(kPositionBias) + steps(x, kLengthBits, kLengthRange));
}
Units depth_units(float x) {
  return static_cast<Units>(std::max<int64_t>(0, steps(x, kLengthBits, kLengthRange)));
}
Units uv_units(float x) { return position_units(x); }
Units motion_units(float x) {
  return static_cast<Units>(static_cast<int64_t>(kMotionBias) + steps(x, kPixelBits, kPixelBits));
}

Units square_units(float radiance, int quantum_exponent) {
  const double x = std::ldexp(double{radiance}, -(quantum_exponent + kQuantumBitsBelowScale));
  const double limit = std::ldexp(1.0, kMaxContributionBits - 1);
  const double square = std::ldexp(x * x, kSquareBits) + 0.5;
  return square < limit ? static_cast<Units>(square) : static_cast<Units>(limit);  // NaN: the limit
}

double albedo_of(Units sum, int64_t weights) {
  return std::ldexp(to_double(sum), -kFractionBits) / static_cast<double>(weights);
}

double normal_of(Units sum, int64_t weights) {
  return std::ldexp(unbiased(sum, kNormalBias, weights), -kFractionBits) / static_cast<double>(weights);
}

double position_of(Units sum, int64_t hits, const AovFrame& frame, int axis) {
  const double mean = unbiased(sum, kPositionBias, hits) / static_cast<double>(hits);
  return frame.origin[static_cast<size_t>(axis)] + std::ldexp(mean, -kLengthBits - frame.scale_exponent);
}

double depth_of(Units sum, int64_t hits, const AovFrame& frame) {
  return std::ldexp(to_double(sum) / static_cast<double>(hits), -kLengthBits - frame.scale_exponent);
}

double uv_of(Units sum, int64_t hits) {
  return std::ldexp(unbiased(sum, kUvBias, hits) / static_cast<double>(hits), -kLengthBits);
}

double motion_of(Units sum, int64_t hits) {
  return std::ldexp(unbiased(sum, kMotionBias, hits) / static_cast<double>(hits), -kPixelBits);
}

double variance_of(Units squares, int64_t weights, Units sum, int64_t samples, int64_t count,
                   int quantum_exponent) {
  if (count < 2) return 0;
  const auto n = static_cast<double>(count);
  // In units of S: both terms are near 1, where radiance itself may be anywhere in double's range.
  const double mean = std::ldexp(to_double(sum), -kQuantumBitsBelowScale) / static_cast<double>(samples);
  const double square = std::ldexp(to_double(squares), -kSquareBits) / static_cast<double>(weights);
  const double variance = std::max(0.0, square - mean * mean) * (n / (n - 1));
  return std::ldexp(variance, 2 * (quantum_exponent + kQuantumBitsBelowScale));
}

}  // namespace lightmill
