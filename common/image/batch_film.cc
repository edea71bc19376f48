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
// The 2/n: B_b - M = (B_b - M')(n-1)/n holds the error d = M' - R too, which is not independent of M';
// E[d^2 f(M')] - t' E[f(M')] = t'^2 f''(R) + ..., which is 2 z/n of v f(R) (n-1)/n.
// If the other batches have missed what b saw, M' ~ 0 and w ~ 1/e says nothing about the pixel; w is
// therefore at most 3 f(M). With n = 2 there is no v' of one batch: there w = 1/(max(0, M^2 - t) + e), at
// most 2 f(M). In simulations with normal, gamma and log-normal B the bias of v w was below 1 % for a
// relative noise of a batch up to 50 %, and about 10 % up to 100 % for n >= 8; fewer batches or more noise
// cost more
// (-50..+30 %): there the samples at hand do not tell.
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
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/error.h"
#include "common/image/error_curve.h"
#include "common/image/packing.h"
#include "common/settings.h"

namespace lightmill {

namespace {

constexpr uint32_t kMagic = 0x6662694c;  // "Libf"
constexpr uint32_t kVersion = 1;
constexpr const char* kWhat = "batch film snapshot";
constexpr double kEpsilon = 1e-2;  // of relMSE
constexpr size_t kStrip = 512;     // values per pass: mean and variance stay in the L1 cache

size_t index(int64_t i) { return static_cast<size_t>(i); }

double to_double(Units units) {
  return static_cast<double>(static_cast<uint64_t>(units >> 64)) * 0x1p64 +
         static_cast<double>(static_cast<uint64_t>(units));
}

/// A bijection of 64-bit words with good avalanche (the finalizer of SplitMix64; Steele et al. 2014).
uint64_t mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

double relative_weight(double mean) { return 1 / (mean * mean + kEpsilon); }

/// w of the derivation, before its cap: 1 / (R^2 + e) from a mean with variance t; `stretch` = 1 + 2/n.
inline double corrected_weight(double mean, double t, double stretch) {
  const double m2 = mean * mean;
  const double f = 1 / (m2 + kEpsilon);
  const double z = stretch * t * (3 * m2 - kEpsilon) * f * f;
  const double bright = f / (1 + std::max(z, 0.0));
  const double dark = std::min(1 / kEpsilon, f * (1 - z));
  return z >= 0 ? bright : dark;
}

/// Adds each batch's d_b over one strip of values. `sums`: per batch, the strip's sums of samples.
void add_deviations(const std::vector<const float*>& sums, size_t size, double to_mean,
                    std::vector<double>* d) {
  const size_t count = sums.size();
  const auto n = static_cast<double>(count);
  std::array<double, kStrip> mean{}, square{}, cap;  // M, sum_b (B_b - M)^2, the largest w
  for (const float* b : sums) {
    for (size_t i = 0; i < size; ++i) mean[i] += static_cast<double>(b[i]) * (to_mean / n);
  }
  for (const float* b : sums) {
    for (size_t i = 0; i < size; ++i) {
      const double deviation = static_cast<double>(b[i]) * to_mean - mean[i];
      square[i] += deviation * deviation;
    }
  }
  if (count == 2) {
    double sum = 0;
    for (size_t i = 0; i < size; ++i) {
      const double corrected = std::max(0.0, mean[i] * mean[i] - square[i] / 2) + kEpsilon;
      sum += square[i] * std::min(1 / corrected, 2 * relative_weight(mean[i]));
    }
    for (double& v : *d) v += sum;
    return;
  }
  for (size_t i = 0; i < size; ++i) cap[i] = 3 * relative_weight(mean[i]);
  for (size_t k = 0; k < count; ++k) {
    double sum = 0;
    for (size_t i = 0; i < size; ++i) {
      const double deviation = static_cast<double>(sums[k][i]) * to_mean - mean[i];
      const double single = deviation * deviation * (n / (n - 1));
      const double others_mean = mean[i] - deviation / (n - 1);
      // Sum of squares of the other n-1 batches about their own mean.
      const double others_square = std::max(0.0, square[i] - single);
      const double t = others_square / ((n - 2) * (n - 1));
      sum += single * std::min(cap[i], corrected_weight(others_mean, t, 1 + 2 / n));
    }
    (*d)[k] += sum;
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

BatchFilm::BatchFilm(const FilmGrid& grid) : grid_(grid) {
  const int64_t pixels = grid.crop.area();
  tracked_pixels_ = std::min(pixels, kMaxTrackedPixels);
  if (tracked_pixels_ == pixels) return;
  // One pixel of each of kMaxTrackedPixels equal strata.
  tracked_.resize(index(tracked_pixels_));
  for (int64_t i = 0; i < tracked_pixels_; ++i) {
    const int64_t begin = i * pixels / tracked_pixels_, end = (i + 1) * pixels / tracked_pixels_;
    const auto offset =
        static_cast<int64_t>(mix(static_cast<uint64_t>(i)) % static_cast<uint64_t>(end - begin));
    tracked_[index(i)] = static_cast<uint32_t>(begin + offset);
  }
}

/// Position of a pixel among the tracked ones, or -1.
int64_t BatchFilm::tracked_index(int64_t crop_index) const {
  if (tracked_.empty()) return crop_index;
  const int64_t stratum = ((crop_index + 1) * tracked_pixels_ - 1) / grid_.crop.area();
  return int64_t{tracked_[index(stratum)]} == crop_index ? stratum : -1;
}

void BatchFilm::merge_pairs() {
  for (size_t i = 0; 2 * i < batches_.size(); ++i) {
    Batch merged = std::move(batches_[2 * i]);
    if (2 * i + 1 < batches_.size()) {
      Batch& other = batches_[2 * i + 1];
      merged.samples += other.samples;
      if (merged.rgb.empty()) {
        merged.rgb = std::move(other.rgb);
      } else if (!other.rgb.empty()) {
        for (size_t k = 0; k < merged.rgb.size(); ++k) merged.rgb[k] += other.rgb[k];
      }
    }
    batches_[i] = std::move(merged);
  }
  batches_.resize((batches_.size() + 1) / 2);
  group_ *= 2;
}

void BatchFilm::fold(const Partial& partial) {
  if (partial.grid != grid_) throw Error(ErrorKind::kFailed, "partial was rendered for another film");
  const PixelRect r = grid_.pixels(partial.tile.cells);
  if (!partial.camera.empty() && partial.camera.size() != index(r.area())) {
    throw Error(ErrorKind::kFailed, "partial has a camera layer of another size than its tile");
  }
  const int64_t first = superblock_of_sample(partial.tile.sample_begin);
  const int64_t last = superblock_of_sample(partial.tile.sample_end - 1);
  while (first / group_ != last / group_ || first / group_ >= kMaxBatches) merge_pairs();
  const auto batch_index = index(first / group_);
  if (batches_.size() <= batch_index) batches_.resize(batch_index + 1);
  Batch& batch = batches_[batch_index];
  if (batch.rgb.empty()) batch.rgb.resize(3 * index(tracked_pixels_));

  const double quantum = std::ldexp(1.0, partial.quantum_exponent);
  const auto add = [&](int64_t crop_index, const ExactRgb& sum) {
    const int64_t at = tracked_index(crop_index);
    if (at < 0) return;
    float* rgb = &batch.rgb[3 * index(at)];
    for (int c = 0; c < 3; ++c) rgb[c] += static_cast<float>(to_double(sum.c[c]) * quantum);
  };
  const ExactRgb* from = partial.camera.data();
  for (int y = r.y0; !partial.camera.empty() && y < r.y1; ++y) {
    const int64_t row = int64_t{y - grid_.crop.y0} * grid_.crop.width() - grid_.crop.x0;
    for (int x = r.x0; x < r.x1; ++x) add(row + x, *from++);
  }
  for (const Partial::SplatSum& splat : partial.splats) {
    const int64_t crop_index = grid_.crop_index(splat.pixel);
    if (crop_index >= 0) add(crop_index, splat.sum);
  }
  batch.samples += r.area() * partial.tile.samples();
}

std::vector<const BatchFilm::Batch*> BatchFilm::complete_batches() const {
  const int64_t full = grid_.crop.area() * kSuperblockSamples * group_;
  std::vector<const Batch*> complete;
  for (const Batch& batch : batches_) {
    if (batch.samples == full) complete.push_back(&batch);
  }
  return complete;
}

double BatchFilm::spp() const {
  double samples = 0;
  for (const Batch& batch : batches_) samples += static_cast<double>(batch.samples);
  return tracked_pixels_ > 0 ? samples / static_cast<double>(grid_.crop.area()) : 0;
}

void BatchFilm::estimate(ErrorPoint* point) const {
  const std::vector<const Batch*> batches = complete_batches();
  const size_t count = batches.size();
  point->batches = static_cast<int>(count);
  point->relmse.reset();
  point->relmse_low.reset();
  point->relmse_high.reset();
  if (count < 2) return;

  const auto n = static_cast<double>(count);
  const double batch_spp = static_cast<double>(kSuperblockSamples * group_);
  const size_t values = 3 * index(tracked_pixels_);
  std::vector<double> d(count, 0.0);
  std::vector<const float*> sums(count);
  for (size_t begin = 0; begin < values; begin += kStrip) {
    for (size_t k = 0; k < count; ++k) sums[k] = &batches[k]->rgb[begin];
    add_deviations(sums, std::min(kStrip, values - begin), 1 / batch_spp, &d);
  }
  double average = 0, variance = 0;
  for (double& v : d) average += (v /= static_cast<double>(values)) / n;
  for (const double v : d) variance += (v - average) * (v - average) / (n - 1);
  const double deviation = count > 2 ? std::sqrt(variance / n * (n - 1) / (n - 2)) : std::sqrt(2.0) * average;
  const double half_width = student_t_975(static_cast<int>(count) - 1) * deviation;
  const double scale = batch_spp / spp();
  point->relmse = average * scale;
  point->relmse_low = std::max(0.0, average - half_width) * scale;
  point->relmse_high = (average + half_width) * scale;
}

std::string BatchFilm::snapshot() const {
  ByteWriter w;
  for (const int v :
       {grid_.width, grid_.height, grid_.crop.x0, grid_.crop.y0, grid_.crop.x1, grid_.crop.y1}) {
    w.put<int32_t>(v);
  }
  w.put<int64_t>(group_);
  w.put<uint32_t>(static_cast<uint32_t>(batches_.size()));
  for (const Batch& batch : batches_) {
    w.put<int64_t>(batch.samples);
    w.put<uint8_t>(!batch.rgb.empty());
    w.put_bytes({reinterpret_cast<const char*>(batch.rgb.data()), batch.rgb.size() * sizeof(float)});
  }
  return seal(kMagic, kVersion, w.bytes());
}

BatchFilm BatchFilm::restore(std::string_view bytes) {
  const std::string raw = unseal(kMagic, kVersion, bytes, kWhat);
  ByteReader in(raw, kWhat);
  FilmGrid grid;
  for (int* v : {&grid.width, &grid.height, &grid.crop.x0, &grid.crop.y0, &grid.crop.x1, &grid.crop.y1}) {
    *v = in.get<int32_t>();
  }
  const bool empty = grid == FilmGrid{};
  if (!empty && (grid.width < 1 || grid.height < 1 || int64_t{grid.width} * grid.height > kMaxPixels ||
                 grid.crop.empty() || grid.crop.x0 < 0 || grid.crop.y0 < 0 || grid.crop.x1 > grid.width ||
                 grid.crop.y1 > grid.height)) {
    in.fail("film size out of range");
  }
  BatchFilm film = empty ? BatchFilm() : BatchFilm(grid);
  film.group_ = in.get<int64_t>();
  const auto count = in.get<uint32_t>();
  if (film.group_ < 1 || film.group_ > kMaxSampleIndex || count > kMaxBatches) in.fail("count out of range");
  film.batches_.resize(count);
  for (Batch& batch : film.batches_) {
    batch.samples = in.get<int64_t>();
    if (in.get<uint8_t>() == 0) continue;
    const std::string_view values = in.get_bytes(3 * index(film.tracked_pixels_) * sizeof(float));
    batch.rgb.resize(3 * index(film.tracked_pixels_));
    std::memcpy(batch.rgb.data(), values.data(), values.size());
  }
  in.expect_end();
  return film;
}

}  // namespace lightmill
