#include "worker/render/pipeline/recording/part_sums.h"

#include <algorithm>
#include <cmath>

#include "common/film/signed_sum.h"

namespace lightmill {
namespace {

/// Samples below so many units are summed in 64 bits: 2^7 of them, where a pixel has 2^6 in a packet at most.
constexpr int kNarrowBits = 56;
constexpr double kNarrow = 0x1p56;
static_assert(kSuperblockSamples * kMaxSamplesPerIndex < 1 << (63 - kNarrowBits));

bool is_dark(const std::array<float, 3>& rgb) { return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0; }

}  // namespace

void PartSums::begin_packet() {
  narrow_.assign(3 * layers_ * kCellPixels, 0);
  wide_.clear();
}

/// The sample in units of 64 bits, half up as to_units. False, with nothing added, if it is too bright for
/// that.
bool PartSums::add_narrow(double scale, float weight, const std::array<float, 3>* light,
                          const std::array<Units, 3>& whole, int64_t* to) const {
  if ((whole[0] | whole[1] | whole[2]) >> kNarrowBits) return false;
  int64_t left[3];
  for (size_t c = 0; c < 3; ++c) left[c] = static_cast<int64_t>(whole[c]);
  int64_t* last = nullptr;
  for (size_t part = 0; part < layers_; ++part, to += 3) {
    const std::array<float, 3>& rgb = light[part];
    if (is_dark(rgb)) continue;
    last = to;
    for (size_t c = 0; c < 3; ++c) {
      // Parts are no larger than the whole but for rounding: what is far larger, or no number, is cut.
      const double x = double{rgb[c] * weight} * scale + 0.5;
      const int64_t units = std::min(x >= 0 && x < kNarrow ? static_cast<int64_t>(x) : left[c], left[c]);
      left[c] -= units;
      to[c] += units;
    }
  }
  if (last && is_dark(light[layers_])) {
    for (size_t c = 0; c < 3; ++c) last[c] += left[c];
  }
  return true;
}

void PartSums::add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w, size_t slot,
                          std::array<float, 3>* light, const std::array<Units, 3>& whole) {
  const auto pixel = static_cast<size_t>(w.slots.pixel[slot]);
  const float weight = w.slots.weight[slot];
  for (size_t part = 0; context.response && part < layers_; ++part)
    context.response->mix(&light[part][0], &light[part][1], &light[part][2]);
  if (!context.signed_film &&
      add_narrow(std::ldexp(1.0, -quantum_exponent), weight, light, whole, &narrow_[3 * pixel * layers_]))
    return;
  if (wide_.empty()) wide_.resize(layers_ * kCellPixels);
  std::array<Units, 3> left = whole;
  ExactRgb* last = nullptr;
  for (size_t part = 0; part < layers_; ++part) {
    if (is_dark(light[part])) continue;
    last = &wide_[pixel * layers_ + part];
    for (size_t c = 0; c < 3; ++c) {
      const float x = light[part][c] * weight;
      Units units =
          (context.signed_film ? to_signed_units(x, quantum_exponent) : to_units(x, quantum_exponent))
              .value_or(left[c]);
      if (!context.signed_film) units = std::min(units, left[c]);
      left[c] -= units;
      last->c[c] += units;
    }
  }
  if (last && is_dark(light[layers_])) {
    for (size_t c = 0; c < 3; ++c) last->c[c] += left[c];
  }
}

std::span<const ExactRgb, kCellPixels> PartSums::layer(size_t part) {
  layer_.assign(kCellPixels, {});
  for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
    const size_t at = pixel * layers_ + part;
    for (size_t c = 0; c < 3; ++c) layer_[pixel].c[c] = static_cast<Units>(narrow_[3 * at + c]);
    if (!wide_.empty()) layer_[pixel] += wide_[at];
  }
  return std::span<const ExactRgb, kCellPixels>(layer_);
}

}  // namespace lightmill
