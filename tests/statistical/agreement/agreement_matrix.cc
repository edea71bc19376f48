#include "tests/statistical/agreement/agreement_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/scene/load.h"
#include "tests/support/render.h"
#include "worker/render/diagnose/diagnosis.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;
/// Side of a block in pixels: longer paths add little, and all pixels are needed to say something.
int block_size(int vertices, int width) { return vertices <= 4 ? 8 : width; }
/// Estimates of pairs of floats that agree better than this are equal: sums of float images.
constexpr double kRounding = 2e-5;

std::vector<double> block_means(const Image& image, int size) {
  const int columns = image.width / size, rows = image.height / size;
  std::vector<double> means(static_cast<size_t>(columns * rows) * 3);
  for (int y = 0; y < rows * size; ++y) {
    for (int x = 0; x < columns * size; ++x) {
      const auto block = static_cast<size_t>(y / size * columns + x / size);
      for (size_t c = 0; c < 3; ++c) means[block * 3 + c] += image.pixel(x, y)[c] / double(size * size);
    }
  }
  return means;
}

void add(Image* to, const Image& image, double scale) {
  for (size_t i = 0; i < to->data.size(); ++i) to->data[i] += static_cast<float>(image.data[i] * scale);
}

void add_batch(Estimator* e, const Image& image, int vertices) {
  e->batches.push_back(block_means(image, block_size(vertices, image.width)));
  if (e->picture.data.empty()) e->picture = Image(image.width, image.height);
  add(&e->picture, image, 1.0 / kBatches);
}

/// What a render adds to paths of `k` vertices, weights and all.
Image weighted_image(const Diagnosis& d, int k, double spp) {
  Image sum(d.image.width, d.image.height);
  for (int s = 0; s < k; ++s) {
    if (const auto part = d.film.weighted(s, k - s, spp)) add(&sum, *part, 1);
  }
  return sum;
}

Image alone_image(const Diagnosis& d, int s, int t, double spp) {
  auto image = d.film.unweighted(s, t, spp);
  return image ? std::move(*image) : Image(d.image.width, d.image.height);
}

/// pt makes every path; lt the same as the strategies with one camera vertex.
bool sees(Integrator integrator, const Sight& sight, int k) {
  return integrator != Integrator::kLt || sight.seen_by(k - 1, 1);
}

struct Difference {
  double z = 0, noise = 0, error = 0, mean = 0;
};
/// Of entry `i` of two estimators.
Difference difference(const Estimator& a, const Estimator& b, size_t i) {
  std::vector<double> d, sum;
  for (size_t n = 0; n < a.batches.size(); ++n) {
    d.push_back(a.batches[n][i] - b.batches[n][i]);
    sum.push_back((a.batches[n][i] + b.batches[n][i]) / 2);
  }
  const Estimate e = estimate(d);
  Difference out;
  out.mean = std::fabs(estimate(sum).mean);
  out.error = std::hypot(e.standard_error, kRounding * out.mean);
  if (!(out.error > 0)) return out;  // both are black
  const double p = student_two_sided(std::fabs(e.mean) / out.error, e.n - 1);
  out.z = std::copysign(largest_z(p), e.mean);
  out.noise = out.error / out.mean;
  return out;
}

}  // namespace

bool Sight::seen_by(int s, int t) const {
  if (!has(s + t)) return false;
  if (s == 0) return !delta_lights;
  // Light and lens joined directly.
  if (s == 1 && t == 1) return !far_lights;
  return !delta_surfaces;
}

const std::vector<MatrixScene>& matrix_scenes() {
  static const std::vector<MatrixScene> all{
      {"diffuse", 3, {}},
      {"metal", 3, {}},
      {"glass", 4, {.delta_surfaces = true}},
      {"frosted", 2, {}},
      {"coats", 3, {}},
      {"smooth_coats", 3, {.delta_surfaces = true}},
      {"mix", 3, {}},
      {"textures", 3, {}},
      {"sky", 3, {.far_lights = true}},
      {"lamps", 3, {.delta_lights = true}},
      {"lens", 3, {}},
      {"fog", 2, {}},
      {"bodies", 3, {}, 2},
  };
  return all;
}

SceneEstimates estimate_scene(const MatrixScene& chosen, int64_t spp) {
  spp *= chosen.times_spp;
  const SceneDescription scene =
      load_scene_file(LIGHTMILL_SOURCE_DIR "/tests/statistical/agreement/" + chosen.name + ".pbrt",
                      {.strict = true}, [](const Problem&) {});
  SceneEstimates out{chosen, {}, 0};
  const int longest = chosen.max_depth + 2;
  for (int k = 2; k <= longest; ++k) {
    if (chosen.sight.has(k)) out.lengths.push_back({k, {}});
  }
  for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt}) {
    for (uint64_t b = 0; b < kBatches; ++b) {
      const uint64_t seed = 1 + b + 1000 * static_cast<uint64_t>(integrator);
      const Diagnosis d = diagnose(scene, settings_for(scene, integrator, spp, chosen.max_depth, seed), 1,
                                   [] { return true; });
      out.nonfinite += d.counters.nonfinite;
      for (PathLength& length : out.lengths) {
        const int k = length.vertices;
        size_t next = 0;  // of the estimators that this integrator fills
        for (const Estimator& e : length.estimators) next += e.batches.size() > b ? 1 : 0;
        const auto put = [&](const std::string& name, const Image& image) {
          if (b == 0) length.estimators.push_back({name, {}, {}});
          add_batch(&length.estimators[next++], image, k);
        };
        if (sees(integrator, chosen.sight, k))
          put(integrator_name(integrator), weighted_image(d, k, static_cast<double>(spp)));
        if (integrator != Integrator::kBdpt) continue;
        for (int s = 0; s < k; ++s) {
          if (!chosen.sight.seen_by(s, k - s)) continue;
          put("(" + std::to_string(s) + "," + std::to_string(k - s) + ")",
              alone_image(d, s, k - s, static_cast<double>(spp)));
        }
      }
    }
  }
  return out;
}

int64_t tests_in(const PathLength& length) {
  const auto n = static_cast<int64_t>(length.estimators.size());
  return n * (n - 1) / 2 * static_cast<int64_t>(length.estimators[0].batches[0].size());
}

Matrix compare(const PathLength& length, double level) {
  const auto& e = length.estimators;
  Matrix m;
  m.vertices = length.vertices;
  m.notices.assign(e.size(), HUGE_VAL);
  const double quantile = student_quantile(level, kBatches - 1);
  for (size_t i = 0; i < e.size(); ++i) {
    std::vector<Cell>& row = m.cells.emplace_back();
    for (size_t j = 0; j < i; ++j) {
      Cell worst;
      double finest = HUGE_VAL;
      for (size_t n = 0; n < e[i].batches[0].size(); ++n) {
        const Difference d = difference(e[i], e[j], n);
        if (!(d.mean > 0) || d.noise > kNoisiest) continue;
        if (std::fabs(d.z) >= std::fabs(worst.z)) worst = {d.z, d.noise};
        finest = std::min(finest, quantile * d.noise);
      }
      row.push_back(worst);
      m.notices[i] = std::min(m.notices[i], finest);
      m.notices[j] = std::min(m.notices[j], finest);
    }
  }
  return m;
}

// The inverse of erfc by bisection.
double largest_z(double level) {
  double lo = 0, hi = 38;
  for (int i = 0; i < 100; ++i) {
    const double mid = 0.5 * (lo + hi);
    (std::erfc(mid / std::sqrt(2.0)) > level ? lo : hi) = mid;
  }
  return lo;
}

PathLength scaled(const PathLength& length, size_t i, double factor) {
  PathLength out = length;
  for (std::vector<double>& batch : out.estimators[i].batches) {
    for (double& x : batch) x *= factor;
  }
  return out;
}

}  // namespace lightmill::test
