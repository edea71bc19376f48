// The error estimate.
//
// Let B_1..B_n be the images of the n complete batches (N samples per pixel each), M their mean, and per
// pixel and channel R = E[B], v = Var(B). The blocks of samples have scrambles of their own, so the B_b are
// independent. The image of all S samples per pixel that are folded so far has the expected error
//
//   relMSE = mean_p( v N/S * f(R) ),   f(x) = 1 / (x^2 + e),  e = 1e-2,  mean over pixels and channels.
//
// Numerator. E[(B_b - M)^2] = v (n-1)/n, so (B_b - M)^2 n/(n-1) is unbiased for v.
//
// Denominator. f(M) is not f(R): M has the variance t = v/n. E[f(M)] = f(R) + f''(R) t/2 + O(t^2) with
// f''(x)/2 = (3 x^2 - e) f(x)^3. Where R^2 << e the noise makes f(M) too small (E[M^2] = R^2 + t: dark
// pixels look bright), where R^2 >> e it makes it too large (1/x^2 is convex). And a firefly raises
// (B_b - M)^2 and M together, which would hide it behind its own denominator. So for batch b the denominator
// comes from the *other* batches, M' = (n M - B_b)/(n-1), t' = v'/(n-1), corrected to first order in t':
//
//   w = f(M') / (1 + z)          for z >= 0,
//   w = min(1/e, f(M') (1 - z))  for z < 0,     z = (1 + 2/n) t' (3 M'^2 - e) f(M')^2.
//
// The 2/n: B_b - M = (B_b - M')(n-1)/n holds the error d = M' - R too, which is not independent of M'; E[d^2
// f(M')] - t' E[f(M')] = t'^2 f''(R) + ..., which is 2 z/n of v f(R) (n-1)/n. If the other batches have
// missed what b saw, M' ~ 0 and w ~ 1/e says nothing about the pixel; w is therefore at most 3 f(M). With n
// = 2 there is no v' of one batch: there w = 1/(max(0, M^2 - t) + e), at most 2 f(M). In simulations with
// normal, gamma and log-normal B the bias of v w was below 1 % for a relative noise of a batch up to 50 %,
// and about 10 % up to 100 % for n >= 8; fewer batches or more noise cost more (-50..+30 %): there the
// samples at hand do not tell.
//
// Per batch d_b = mean_p( (B_b - M)^2 n/(n-1) * w_b ): the image-level error of one batch. Then
//
//   relMSE ~ mean_b(d_b) N/S.
//
// Interval. The pixels of an image are correlated (they share light paths and caches), the batches are not;
// the spread is therefore taken over the n values d_b. They are slightly correlated through M: for normal B,
// Var(mean_b d_b) = (n-1)/(n-2) times the naive var(d_b)/n. With Student's t of n-1 degrees of freedom
//
//   mean_b(d_b) +- t_{0.975} sqrt( var(d_b)/n * (n-1)/(n-2) ),  times N/S, not below 0.
//
// With n = 2, d_1 and d_2 are equal by construction; the spread is then the worst case, that of one
// normal variable in all pixels: d = v chi^2_1, standard deviation sqrt(2) d. It is the interval of the
// *expected* error at S samples; the error of the one image at hand scatters around that, little if its
// pixels are many and weakly correlated.
#include "common/image/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace lightmill {

namespace {

constexpr double kEpsilon = 1e-2;  // of relMSE
constexpr size_t kStrip = 512;     // values per pass: mean and variance stay in the L1 cache

double relative_weight(double mean) { return 1 / (mean * mean + kEpsilon); }

/// w of the derivation, before its cap: 1 / (R^2 + e) from a mean with variance t; `stretch` = 1 + 2/n.
/// With D = mean^2 + e and z = y / D^2: D / (D^2 + y) or (D^2 - y) / D^3, so that one division does.
inline double corrected_weight(double mean, double t, double stretch) {
  const double m2 = mean * mean;
  const double d = m2 + kEpsilon;
  const double y = stretch * t * (3 * m2 - kEpsilon);
  const double numerator = y >= 0 ? d : d * d - y;
  const double denominator = y >= 0 ? d * d + y : d * d * d;
  return std::min(1 / kEpsilon, numerator / denominator);
}

/// Sum of a strip, in four interleaved parts: a single chain of additions would be all latency.
double sum_of(const std::array<double, kStrip>& terms, size_t size) {
  double part[4] = {0, 0, 0, 0};
  size_t i = 0;
  for (; i + 4 <= size; i += 4) {
    for (size_t k = 0; k < 4; ++k) part[k] += terms[i + k];
  }
  for (; i < size; ++i) part[0] += terms[i];
  return (part[0] + part[1]) + (part[2] + part[3]);
}

/// Adds each batch's d_b over the strip of values that begins at `begin`.
void add_deviations(std::span<const float* const> sums, size_t begin, size_t size, double to_mean,
                    std::vector<double>* d) {
  const size_t count = sums.size();
  const auto n = static_cast<double>(count);
  std::array<double, kStrip> mean{}, square{};  // M, sum_b (B_b - M)^2
  std::array<double, kStrip> cap, terms;        // the largest w; what is summed over the strip
  for (const float* sum : sums) {
    const float* b = sum + begin;
    for (size_t i = 0; i < size; ++i) mean[i] += static_cast<double>(b[i]) * (to_mean / n);
  }
  for (const float* sum : sums) {
    const float* b = sum + begin;
    for (size_t i = 0; i < size; ++i) {
      const double deviation = static_cast<double>(b[i]) * to_mean - mean[i];
      square[i] += deviation * deviation;
    }
  }
  if (count == 2) {
    for (size_t i = 0; i < size; ++i) {
      const double corrected = std::max(0.0, mean[i] * mean[i] - square[i] / 2) + kEpsilon;
      terms[i] = square[i] * std::min(1 / corrected, 2 * relative_weight(mean[i]));
    }
    for (double& v : *d) v += sum_of(terms, size);
    return;
  }
  const double to_others = 1 / ((n - 2) * (n - 1)), unbias = n / (n - 1), to_rest = 1 / (n - 1);
  for (size_t i = 0; i < size; ++i) cap[i] = 3 * relative_weight(mean[i]);
  for (size_t k = 0; k < count; ++k) {
    for (size_t i = 0; i < size; ++i) {
      const double deviation = static_cast<double>(sums[k][begin + i]) * to_mean - mean[i];
      const double single = deviation * deviation * unbias;
      const double others_mean = mean[i] - deviation * to_rest;
      // Sum of squares of the other n-1 batches about their own mean.
      const double others_square = std::max(0.0, square[i] - single);
      const double t = others_square * to_others;
      terms[i] = single * std::min(cap[i], corrected_weight(others_mean, t, 1 + 2 / n));
    }
    (*d)[k] += sum_of(terms, size);
  }
}

}  // namespace

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

BatchError estimate_batch_error(std::span<const float* const> sums, size_t values, double samples) {
  const size_t count = sums.size();
  if (count < 2) throw std::logic_error("estimate_batch_error: at least two batches");
  const auto n = static_cast<double>(count);
  std::vector<double> d(count, 0.0);
  for (size_t begin = 0; begin < values; begin += kStrip) {
    add_deviations(sums, begin, std::min(kStrip, values - begin), 1 / samples, &d);
  }
  double average = 0, variance = 0;
  for (double& v : d) average += (v /= static_cast<double>(values)) / n;
  for (const double v : d) variance += (v - average) * (v - average) / (n - 1);
  const double deviation = count > 2 ? std::sqrt(variance / n * (n - 1) / (n - 2)) : std::sqrt(2.0) * average;
  return {average, student_t_975(static_cast<int>(count) - 1) * deviation};
}

}  // namespace lightmill
