#pragma once
// The width of confidence intervals whose variance is itself an estimate.

namespace lightmill {

/// 97.5 % quantile of Student's t with `dof` >= 1 degrees of freedom: half-width of a 95 % interval.
double student_t_975(int dof);

}  // namespace lightmill
