#include "worker/render/pipeline/recording/group_recorder.h"

#include <algorithm>
#include <cmath>

#include "common/film/signed_sum.h"
#include "worker/render/renderer.h"

namespace lightmill {
namespace {

/// Samples below so many units are summed in 64 bits: 2^7 of them, where a pixel has 2^6 in a packet at most.
constexpr int kNarrowBits = 56;
constexpr double kNarrow = 0x1p56;
static_assert(kSuperblockSamples * kMaxSamplesPerIndex < 1 << (63 - kNarrowBits));

}  // namespace

void GroupRecorder::begin_packet() {
  narrow_.assign(3 * layers_ * kCellPixels, 0);
  wide_.clear();
  light_.splat_groups.clear();
}

void GroupRecorder::begin_pass() {
  std::fill(light_.radiance.begin(), light_.radiance.end(), std::array<float, 3>{});
}

/// The sample in units of 64 bits, half up as to_units. False, with nothing added, if it is too bright for
/// that.
bool GroupRecorder::add_narrow(double scale, float weight, const std::array<float, 3>* light,
                               const std::array<Units, 3>& whole, int64_t* to) {
  if ((whole[0] | whole[1] | whole[2]) >> kNarrowBits) return false;
  int64_t left[3];
  for (size_t c = 0; c < 3; ++c) left[c] = static_cast<int64_t>(whole[c]);
  for (size_t group = 0; group < layers_; ++group, to += 3) {
    const std::array<float, 3>& rgb = light[group];
    if (rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0) continue;
    for (size_t c = 0; c < 3; ++c) {
      // Parts are no larger than the whole but for rounding: what is far larger, or no number, is cut.
      const double x = double{rgb[c] * weight} * scale + 0.5;
      const int64_t units = std::min(x >= 0 && x < kNarrow ? static_cast<int64_t>(x) : left[c], left[c]);
      left[c] -= units;
      to[c] += units;
    }
  }
  return true;
}

void GroupRecorder::add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w,
                               size_t slot, const std::array<Units, 3>& whole) {
  const auto pixel = static_cast<size_t>(w.slots.pixel[slot]);
  const float weight = w.slots.weight[slot];
  std::array<float, 3>* light = &light_.radiance[slot * light_.count];
  for (size_t group = 0; context.response && group < layers_; ++group)
    context.response->mix(&light[group][0], &light[group][1], &light[group][2]);
  if (!context.signed_film &&
      add_narrow(std::ldexp(1.0, -quantum_exponent), weight, light, whole, &narrow_[3 * pixel * layers_]))
    return;
  if (wide_.empty()) wide_.resize(layers_ * kCellPixels);
  std::array<Units, 3> left = whole;
  for (size_t group = 0; group < layers_; ++group) {
    for (size_t c = 0; c < 3; ++c) {
      const float x = light[group][c] * weight;
      Units units =
          (context.signed_film ? to_signed_units(x, quantum_exponent) : to_units(x, quantum_exponent))
              .value_or(left[c]);
      if (!context.signed_film) left[c] -= units = std::min(units, left[c]);
      wide_[pixel * layers_ + group].c[c] += units;
    }
  }
}

void GroupRecorder::add_splats(std::span<const Splat> splats, PartialBuilder& builder) {
  const std::vector<uint8_t>& groups = light_.splat_groups;
  std::array<size_t, kMaxLightGroups + 1> begin{};
  for (const uint8_t group : groups) ++begin[group + 1];
  for (size_t group = 1; group < begin.size(); ++group) begin[group] += begin[group - 1];
  std::array<size_t, kMaxLightGroups + 1> at = begin;
  sorted_.resize(splats.size());
  for (size_t i = 0; i < splats.size(); ++i) sorted_[at[groups[i]]++] = splats[i];
  for (size_t group = 0; group < light_.count; ++group) {
    const std::span own = std::span(sorted_).subspan(begin[group], begin[group + 1] - begin[group]);
    if (!own.empty()) builder.add_group_splats(group, own);
  }
  forget_splats();
}

void GroupRecorder::finish_packet(const Packet& packet, PartialBuilder& builder) {
  for (size_t group = 0; group < layers_; ++group) {
    layer_.assign(kCellPixels, {});
    for (size_t pixel = 0; pixel < kCellPixels; ++pixel) {
      const size_t at = pixel * layers_ + group;
      for (size_t c = 0; c < 3; ++c) layer_[pixel].c[c] = static_cast<Units>(narrow_[3 * at + c]);
      if (!wide_.empty()) layer_[pixel] += wide_[at];
    }
    builder.add_group(group, packet.cell_x, packet.cell_y, std::span<const ExactRgb, kCellPixels>(layer_));
  }
}

}  // namespace lightmill
