#pragma once
// What does not reach the image, or not whole: contributions by the reason why, how many and how much light.
//
//   Dropped dropped;
//   if (!r || !g || !b) dropped.refuse({red, green, blue}, quantum_exponent, 1);   // of to_units
//   DroppedShares shares = shares_of(dropped, pixel_samples, image_mean);
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace lightmill {

enum class DropKind {
  kNotFinite,   // NaN or infinite
  kNegative,    // where the film's sums can't be
  kOutOfRange,  // too bright for the exact sums (exact_sum.h)
  kCapped,      // scaled down to a limit that the scene sets; the rest of the sample is kept
  kBelowRange,  // rounded to 0 by the exact sums
};
inline constexpr size_t kDropKinds = 5;
/// "not_finite", "negative", "out_of_range", "capped" or "below_range".
const char* drop_kind_name(DropKind kind);

/// Counts are exact. Amounts are sums of doubles, so their last bits depend on the order of adding.
struct Dropped {
  struct Kind {
    uint64_t count = 0;
    /// Of what is not finite: pixel samples that lack something. Else the light, as the mean of the channels'
    /// magnitudes. Both as they add to the mean of the image, times the number of its pixel samples.
    double amount = 0;
    bool operator==(const Kind&) const = default;
  };
  std::array<Kind, kDropKinds> kinds{};

  Kind& of(DropKind kind) { return kinds[static_cast<size_t>(kind)]; }
  const Kind& of(DropKind kind) const { return kinds[static_cast<size_t>(kind)]; }
  void add(DropKind kind, double amount) {
    ++of(kind).count;
    of(kind).amount += amount;
  }
  /// Adds a contribution that the sums of this quantum refuse. It stands for `samples` pixel samples.
  void refuse(const std::array<float, 3>& rgb, int quantum_exponent, double samples);
  /// Adds a contribution whose sums are 0, unless it is.
  void round_to_zero(const std::array<float, 3>& rgb);
  /// Adds another's, whose amounts count `scale` times.
  void add(const Dropped& other, double scale = 1);
  /// Multiplies all amounts of light.
  void scale_light(double factor);
  /// Takes back what was added, up to the rounding of amounts.
  void subtract(const Dropped& other);
  bool any() const;
  /// Contributions that the sums refused: RenderCounters::nonfinite.
  uint64_t refused() const;
  bool operator==(const Dropped&) const = default;
};

/// The mean of the channels' magnitudes.
double mean_magnitude(const std::array<float, 3>& rgb);

struct DroppedShare {
  uint64_t count = 0;
  /// Of the light that the image would have with it; of what is not finite, of the samples. From 0 to 1;
  /// empty while it is unknown.
  std::optional<double> share = 0;
  bool operator==(const DroppedShare&) const = default;
};
using DroppedShares = std::array<DroppedShare, kDropKinds>;

/// `image_mean`: the mean magnitude of the image's values, if known.
DroppedShares shares_of(const Dropped& dropped, int64_t pixel_samples,
                        const std::optional<double>& image_mean);

}  // namespace lightmill
