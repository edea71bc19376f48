#include "common/film/dropped.h"

#include <algorithm>
#include <cmath>

#include "common/film/exact_sum.h"

namespace lightmill {

namespace {

DropKind why_refused(const std::array<float, 3>& rgb, int quantum_exponent) {
  const auto is_finite = [](float x) { return std::isfinite(x); };
  const auto fits = [&](float x) { return to_units(std::fabs(x), quantum_exponent).has_value(); };
  if (!std::all_of(rgb.begin(), rgb.end(), is_finite)) return DropKind::kNotFinite;
  return std::all_of(rgb.begin(), rgb.end(), fits) ? DropKind::kNegative : DropKind::kOutOfRange;
}

}  // namespace

const char* drop_kind_name(DropKind kind) {
  static constexpr std::array kNames = {"not_finite", "negative", "out_of_range", "capped", "below_range"};
  static_assert(kNames.size() == kDropKinds);
  return kNames[static_cast<size_t>(kind)];
}

double mean_magnitude(const std::array<float, 3>& rgb) {
  double sum = 0;
  for (const float x : rgb) sum += std::fabs(double{x});
  return sum / 3;
}

void Dropped::refuse(const std::array<float, 3>& rgb, int quantum_exponent, double samples) {
  const DropKind kind = why_refused(rgb, quantum_exponent);
  add(kind, kind == DropKind::kNotFinite ? samples : mean_magnitude(rgb));
}

void Dropped::round_to_zero(const std::array<float, 3>& rgb) {
  const double amount = mean_magnitude(rgb);
  if (amount > 0) add(DropKind::kBelowRange, amount);
}

void Dropped::add(const Dropped& other, double scale) {
  for (size_t i = 0; i < kDropKinds; ++i) {
    kinds[i].count += other.kinds[i].count;
    kinds[i].amount += other.kinds[i].amount * scale;
  }
}

void Dropped::scale_light(double factor) {
  for (size_t i = 0; i < kDropKinds; ++i) {
    if (static_cast<DropKind>(i) != DropKind::kNotFinite) kinds[i].amount *= factor;
  }
}

void Dropped::subtract(const Dropped& other) {
  for (size_t i = 0; i < kDropKinds; ++i) {
    kinds[i].count -= std::min(kinds[i].count, other.kinds[i].count);
    kinds[i].amount = kinds[i].count == 0 ? 0 : std::max(0.0, kinds[i].amount - other.kinds[i].amount);
  }
}

bool Dropped::any() const {
  return std::any_of(kinds.begin(), kinds.end(), [](const Kind& kind) { return kind.count > 0; });
}

uint64_t Dropped::refused() const {
  return of(DropKind::kNotFinite).count + of(DropKind::kNegative).count + of(DropKind::kOutOfRange).count;
}

DroppedShares shares_of(const Dropped& dropped, int64_t pixel_samples,
                        const std::optional<double>& image_mean) {
  DroppedShares shares;
  for (size_t i = 0; i < kDropKinds; ++i) {
    const Dropped::Kind& kind = dropped.kinds[i];
    shares[i].count = kind.count;
    if (kind.count == 0 || kind.amount == 0) continue;
    shares[i].share.reset();
    if (pixel_samples <= 0) continue;
    const double mean = kind.amount / static_cast<double>(pixel_samples);
    if (static_cast<DropKind>(i) == DropKind::kNotFinite) {
      shares[i].share = std::min(1.0, mean);
    } else if (image_mean) {
      shares[i].share = mean / (mean + *image_mean);
    }
  }
  return shares;
}

}  // namespace lightmill
