#pragma once
// Exact sums of floats of either sign, where a filter has negative lobes or a sensor negative colours: the
// sums of exact_sum.h in two's complement. Values that are not negative have the same units.
#include "common/film/exact_sum.h"

namespace lightmill {

/// As to_units, for either sign: units of x < 0 are those of |x| counted down from 0.
inline std::optional<Units> to_signed_units(float x, int quantum_exponent) {
  const std::optional<Units> units = to_units(std::fabs(x), quantum_exponent);
  // Not by a copy of `units`: GCC 12 takes that through memory, in halves, which stalls on every splat.
  if (!units) return std::nullopt;
  return x < 0 ? Units{0} - *units : *units;
}

inline bool is_negative(Units units) { return units >> 127 != 0; }
inline Units magnitude(Units units) { return is_negative(units) ? Units{0} - units : units; }

/// The value of a sum as a double (rounded once).
inline double from_signed_units(Units units, int quantum_exponent) {
  const double size = from_units(magnitude(units), quantum_exponent);
  return is_negative(units) ? -size : size;
}

}  // namespace lightmill
