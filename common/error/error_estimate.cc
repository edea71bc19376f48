// The error estimate.
//
// Let B_1..B_n be the images of the n complete batches (N samples per pixel each), M their mean, and per
// pixel and channel R = E[B], delta_b = B_b - R. Suppose first that the delta_b are independent, of mean 0;
// they need not be equally distributed, nor normal, and within one image they may be correlated as they like.
// With <x, y> = mean_p(x_p y_p w_p), w = 1 / (R^2 + e), e = 1e-2, mean over pixels and channels, the error of
// M that a comparison with R would show is
//
//   relMSE = <M - R, M - R> = 1/n^2 (sum_b <delta_b, delta_b> + sum_{b != c} <delta_b, delta_c>).
//
// Estimate. d_b = <B_b - M, B_b - M> n/(n-1), relMSE ~ mean_b(d_b) / n: that is unbiased. The weight w of
// batch b is estimated without it: a firefly raises B_b - M and M together, which would hide it behind its
// own denominator. The mean of the others is M' = (n M - B_b)/(n-1), of variance t' = v'/(n-1). (B_b - M
// holds the error M' - R too, which is not independent of M': E[(M' - R)^2 f(M')] - t' E[f(M')] = t'^2 f''(R)
// + ..., hence the stretch 1 + 2/n.) How weights are found is said in error_weights.cc. With n = 2 there is
// no v' of one batch: there M and its variance serve.
//
// Replicates. The batches of one replicate (common/job/replicates.h) are parts of one low-discrepancy
// sequence. Their errors cancel more than those of independent batches would, so the estimate above is too
// large. Only the two replicates are independent. With their means A and B, of n_A and n_B batches, and V the
// error of a single batch that would explain theirs,
//
//   E <A - B, A - B> = V (1/n_A + 1/n_B),   so   V ~ <A - B, A - B> n_A n_B / n,
//
// if the error of a replicate falls as 1/n from its n_A to its n_B batches, which are nearly as many. What
// the sequences gain is the ratio of this V to that of the batches, tr S below, both with the same weights:
//
//   gain = <A - B, A - B> n_A n_B / (n tr S),   and the estimate is mean_b(d_b) (g + trust (gain - g)),
//
// where g is what is expected anyway: 1 for pixels, and for means over boxes of pixels what smaller boxes
// gain. A firefly is in both alike. A - B is a sum of the B_b - M, so the Gram matrix below has all that is
// needed. One difference says little where all pixels go up and down together: the variance of gain is 2
// coherence (below). Such noise comes from few light paths, for which sequences gain next to nothing. So
// trust = 1 / (1
// + (coherence / 0.02)^2): at a standard deviation of 0.2 it is a half. That coherence is taken from pairs of
// different replicates, as the batches of one are not independent.
//
// Interval. It is to cover the error of *this* image. Of independent batches, the estimate differs from that
// by
//
//   -1/(n (n-1)) sum_{b != c} <delta_b, delta_c>
//
// alone: what the single batches did, fireflies included, is in both and cancels. The pairs have mean 0 and,
// with tau = E[<delta_b, delta_c>^2], their sum makes a variance of 2 tau / (n (n-1)). tau is the squared
// Frobenius norm of the covariance of a batch; its unbiased estimate from the centred Gram matrix
// G_bc = <B_b - M, B_c - M>, for any distribution and n >= 4, is that of Himeno & Yamada 2014 (J.
// Multivariate Analysis 130):
//
//   tau ~ (n-1)/(n (n-2) (n-3)) ((n-1)(n-2) |S|^2 + (tr S)^2 - n Q),   S = G/(n-1), Q = sum_b G_bb^2/(n-1).
//
// Correlated pixels (of one light path, of one packet) make tau larger by themselves: nothing is assumed of
// them. Of two replicates there is one such pair, <delta_A, delta_B>, of variance tau' = E<delta_A,
// delta_B>^2. What is taken from the batches is its size against the square of the trace, tau / (tr S)^2, the
// coherence of the pixels' errors. With equally many batches each, that makes a variance of 4 coherence of
// the estimate's square, in place of 2 n/(n-1) coherence; by `trust`, something between the two.
//
// What is left is the error of the weights, which matters where the batches differ much, that is where
// light comes in rare events. Its random part is taken as half the standard error of mean_b(d_b), for which
// Var = var(d_b)/n (n-1)/(n-2), and more of few batches, among which the rare event may be missing: a =
// (1 + 24/n^2)/4 of that; its systematic part as a tenth of what it matters to weigh the deviations by
// M instead of M', tr S - mean_b(d_b). So
//
//   mean_b(d_b)/n +- sqrt( t_{0.975, n(n-1)/2 - 2}^2 2 tau/(n (n-1))
//                          + t_{0.975, n-1}^2 (a var(d_b)/n (n-1)/(n-2) + 1/100 (tr S - mean_b(d_b))^2) / n^2
//                          ),
//
// not below 0: tau is a mean over n (n-1)/2 pairs, var(d_b) one over n batches, hence their quantiles. Of the
// pairs some is lost, as G is centred: n (n-3)/2 would be left if its diagonal told nothing of the rest.
//
// The half, the 24, the tenth and the two pairs are measurements, not theorems.
// tests/bench/planning/error_coverage finds the true error inside in 89 % to 99.5 % of 200 runs on six
// scenes, from 4 to 27 batches, through a box and through a gaussian (with 0 for 24 in 88.5 % of 600 runs at
// 5 batches, where a gaussian spreads a lamp over pixels that it does not cover; with all pairs in 88.5 % to
// 96 % at 4 batches; with a fifth in place of a quarter, which would let a caustic's jobs stop earlier, in 84
// % where tails are as heavy as in BatchFilm's test); Student's t over the d_b alone (without tau) covers 38
// % on a diffuse scene and 99 % on a caustic. With n < 4, tau is unknown and nothing is claimed.
#include "common/error/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "common/base/statistics/student_t.h"

namespace lightmill {

namespace {

constexpr double kDoubtfulCoherence = 0.02;

/// <A - B, A - B> n_A n_B / (n tr S) of the replicates' means A and B; 1 if there is one replicate.
double gain_of_sequences(const BatchMoments& moments, std::span<const int> replicates) {
  const size_t count = replicates.size();
  std::array<double, 2> batches{};
  for (const int r : replicates) batches[static_cast<size_t>(r)] += 1;
  if (batches[0] == 0 || batches[1] == 0) return 1;
  const auto part = [&](size_t b) {
    return (replicates[b] ? -1 : 1) / batches[static_cast<size_t>(replicates[b])];
  };
  double difference = 0, trace = 0;
  for (size_t b = 0; b < count; ++b) {
    trace += moments.at(b, b) / static_cast<double>(count - 1);
    difference += part(b) * part(b) * moments.at(b, b);
    for (size_t c = b + 1; c < count; ++c) difference += 2 * part(b) * part(c) * moments.at(b, c);
  }
  return trace > 0
             ? std::max(difference, 0.0) * batches[0] * batches[1] / (static_cast<double>(count) * trace)
             : 1;
}

struct Covariance {
  double trace = 0;      // tr S
  double coherence = 0;  // tau / (tr S)^2: 1 if all pixels move together, 1/p for p independent ones of equal
                         // error
};

/// tau / (tr S)^2 from pairs of different replicates alone, whose batches are independent: with deviations
/// from their own replicate's mean, E<delta_a - A, delta_b - B>^2 = tau (1 - 1/n_A) (1 - 1/n_B). Empty if a
/// replicate has fewer than two batches.
std::optional<double> coherence_of_replicates(const BatchMoments& moments, std::span<const int> replicates,
                                              double trace) {
  std::array<std::vector<size_t>, 2> of;
  const size_t count = replicates.size();
  for (size_t b = 0; b < count; ++b) of[static_cast<size_t>(replicates[b])].push_back(b);
  if (of[0].size() < 2 || of[1].size() < 2 || !(trace > 0)) return std::nullopt;
  const auto n_a = static_cast<double>(of[0].size()), n_b = static_cast<double>(of[1].size());
  std::vector<double> row(count), column(count);
  double all = 0, tau = 0;
  for (const size_t a : of[0]) {
    for (const size_t b : of[1]) {
      row[a] += moments.at(a, b) / n_b;
      column[b] += moments.at(a, b) / n_a;
      all += moments.at(a, b) / (n_a * n_b);
    }
  }
  for (const size_t a : of[0]) {
    for (const size_t b : of[1]) {
      const double product = moments.at(a, b) - row[a] - column[b] + all;
      tau += product * product / ((n_a - 1) * (n_b - 1));
    }
  }
  return std::min(tau / (trace * trace), 1.0);
}

Covariance covariance(const BatchMoments& moments, size_t values) {
  const size_t count = moments.d.size();
  const auto n = static_cast<double>(count);
  Covariance s;
  double norm = 0, fourth = 0;
  for (size_t b = 0; b < count; ++b) {
    const double diagonal = moments.at(b, b);
    s.trace += diagonal / (n - 1);
    fourth += diagonal * diagonal / (n - 1);
    norm += diagonal * diagonal / ((n - 1) * (n - 1));
    for (size_t c = b + 1; c < count; ++c) {
      norm += 2 * moments.at(b, c) * moments.at(b, c) / ((n - 1) * (n - 1));
    }
  }
  if (!(s.trace > 0)) return s;
  const double square = s.trace * s.trace;
  const double tau = (n - 1) / (n * (n - 2) * (n - 3)) * ((n - 1) * (n - 2) * norm + square - n * fourth);
  s.coherence = std::clamp(tau / square, 1 / static_cast<double>(values), 1.0);
  return s;
}

}  // namespace

BatchError estimate_batch_error(std::span<const float* const> sums, std::span<const int> replicates,
                                const PixelLayout& layout, double samples, double expected_gain) {
  const size_t count = sums.size(), values = 3 * layout.width * layout.rows;
  if (count < 2) throw std::logic_error("estimate_batch_error: at least two batches");
  if (replicates.size() != count) throw std::logic_error("estimate_batch_error: a replicate for each batch");
  const auto n = static_cast<double>(count);
  const BatchMoments moments = batch_moments(sums, layout, 1 / samples);
  BatchError error;
  double variance = 0;
  for (const double d : moments.d) error.relmse += d / n;
  for (const double d : moments.d) variance += (d - error.relmse) * (d - error.relmse) / (n - 1);
  error.gain = gain_of_sequences(moments, replicates);
  if (count >= kMinIntervalBatches) {
    const Covariance c = covariance(moments, values);
    const double doubt =
        coherence_of_replicates(moments, replicates, c.trace).value_or(c.coherence) / kDoubtfulCoherence;
    const double trust = 1 / (1 + doubt * doubt);
    error.gain = expected_gain + trust * (error.gain - expected_gain);
    // Relative to the estimate, so without the n^2 of tau.
    const double pairs = (4 * trust + 2 * n / (n - 1) * (1 - trust)) * c.coherence;
    const double spread = variance / n * (n - 1) / (n - 2) * (1 + 24 / (n * n)) / 4;
    const double shift = 0.1 * (c.trace - error.relmse);
    const double t_pairs = student_t_975(static_cast<int>(count * (count - 1) / 2) - 2),
                 t_batches = student_t_975(static_cast<int>(count) - 1);
    const double others =
        error.relmse > 0 ? t_batches * t_batches * (spread + shift * shift) / (error.relmse * error.relmse)
                         : 0;
    const double half_width = std::sqrt(t_pairs * t_pairs * pairs + others);
    error.interval = {std::max(0.0, 1 - half_width), 1 + half_width};
  }
  error.relmse *= error.gain;
  if (error.interval) error.interval->low *= error.relmse, error.interval->high *= error.relmse;
  return error;
}

}  // namespace lightmill
