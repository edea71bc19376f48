#include "common/base/statistics/student_t.h"

#include <array>
#include <cstddef>
#include <stdexcept>

namespace lightmill {

double student_t_975(int dof) {
  static constexpr std::array<double, 31> kQuantile = {
      12.706205, 4.302653, 3.182446, 2.776445, 2.570582, 2.446912, 2.364624, 2.306004,
      2.262157,  2.228139, 2.200985, 2.178813, 2.160369, 2.144787, 2.131450, 2.119905,
      2.109816,  2.100922, 2.093024, 2.085963, 2.079614, 2.073873, 2.068658, 2.063899,
      2.059539,  2.055529, 2.051831, 2.048407, 2.045230, 2.042272, 2.039513};
  if (dof < 1) throw std::logic_error("student_t_975: at least one degree of freedom");
  if (dof <= 31) return kQuantile[static_cast<size_t>(dof - 1)];
  // Cornish-Fisher expansion around the normal quantile (Abramowitz & Stegun 26.7.5); here exact to 1e-6.
  const double z = 1.959963985, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z, d = dof;
  return z + (z3 + z) / (4 * d) + (5 * z5 + 16 * z3 + 3 * z) / (96 * d * d) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * d * d * d);
}

}  // namespace lightmill
