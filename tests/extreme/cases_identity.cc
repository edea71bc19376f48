// Oracle 17, scaling by powers of two leaves the bits alone; and sums of a million samples that are exact.
#include <cmath>

#include "common/film/film.h"
#include "tests/extreme/case.h"
#include "tests/support/render.h"
#include "tests/support/scaled_scene.h"

namespace lightmill::test {
namespace {

/// Fraction of pixel values whose bits are those of the scene of scale 1.
Measurement equal_bits(const SceneDescription& scene, int k, Integrator integrator) {
  const auto render = [&](const SceneDescription& s) {
    return render_batches(s, settings_for(s, integrator, kSuperblockSamples, 6), 1);
  };
  const Batches original = render(scene), other = render(scaled_scene(scene, k));
  const std::vector<float>&a = original.images[0].data, &b = other.images[0].data;
  size_t equal = 0, lit = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    equal += a[i] == b[i];
    lit += a[i] > 0;
  }
  Measurement m;
  m.exact = 1;
  m.measured = lit == 0 ? 0 : static_cast<double>(equal) / static_cast<double>(a.size());
  m.z = m.measured == 1 ? 0 : HUGE_VAL;
  m.effective_samples = static_cast<double>(lit);
  m.nonfinite = original.counters.nonfinite + other.counters.nonfinite;
  m.picture = other.images[0];
  return m;
}

/// The mean of 10^6 samples through partials and film, sixteen at a time: of `value`, or of the large and
/// small ones in turn.
Measurement million_samples(float even, float odd, int quantum_exponent) {
  constexpr int64_t kSamples = 1000000;
  const FilmGrid grid{1, 1, {0, 0, 1, 1}};
  Film film(grid);
  Measurement m;
  for (int64_t s = 0; s < kSamples; s += kSuperblockSamples) {
    const TileSpec tile{grid.cells(), s, s + kSuperblockSamples};
    PartialBuilder builder(grid, tile, quantum_exponent, true, false);
    std::vector<ExactRgb> sums(kCellPixels);
    for (int i = 0; i < kSuperblockSamples; ++i) {
      for (Units& u : sums[0].c) {
        const auto units = to_units(i % 2 ? odd : even, quantum_exponent);
        if (!units) ++m.nonfinite;
        u += units.value_or(0);
      }
    }
    builder.add_camera(0, 0, std::span<const ExactRgb, kCellPixels>(sums.data(), kCellPixels));
    film.fold(builder.take());
  }
  m.picture = film.resolve();
  m.exact = 0.5 * (double{even} + odd);
  m.measured = m.picture.data[0];
  m.z = static_cast<float>(m.exact) == m.picture.data[0] ? 0 : HUGE_VAL;
  m.effective_samples = kSamples;
  return m;
}

Case sums(std::string parameter, float even, float odd, int quantum_exponent) {
  Case c{"sums of 10^6 samples", std::move(parameter), "the mean, to the last bit of a float", {}, {}};
  c.measure = [=](Integrator) { return million_samples(even, odd, quantum_exponent); };
  return c;
}

}  // namespace

std::vector<Case> identity_cases() {
  std::vector<Case> cases;
  for (const int k : {-60, -31, -1, 1, 31, 60}) {
    Case c{"17 scale by 2^k",
           "k " + std::to_string(k),
           "fraction of pixel values with the same bits",
           area_light_sight(1, 1),
           {}};
    c.measure = [k](Integrator i) { return equal_bits(scene_of_everything().scene, k, i); };
    cases.push_back(std::move(c));
  }
  // A quantum 2^-52 below the brightest emitter, as plans freeze it.
  cases.push_back(sums("0.1 each", 0.1f, 0.1f, -kQuantumBitsBelowScale));
  cases.push_back(sums("1e9 and 1e-6 in turn", 1e9f, 1e-6f, 30 - kQuantumBitsBelowScale));
  cases.push_back(sums("1e-30 each", 1e-30f, 1e-30f, -99 - kQuantumBitsBelowScale));
  cases.push_back(sums("1e30 each", 1e30f, 1e30f, 100 - kQuantumBitsBelowScale));
  return cases;
}

}  // namespace lightmill::test
