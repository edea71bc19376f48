#include "tests/extreme/matrix.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16, kDepth = 4;
constexpr int64_t kSpp = 512;

struct MatrixScene {
  std::string name;
  Sight sight;
  TestScene (*build)();
};

/// The floor and one wall of a room, open to the sky.
TestScene open_corner() {
  TestScene s;
  s.quad({-2, -1, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse(Rgb{0.7f, 0.6f, 0.5f}));
  s.quad({-2, -1, 1}, {0, 2, 0}, {4, 0, 0}, s.diffuse(Rgb{0.3f, 0.5f, 0.7f}));
  s.box({0.1, -1, 0.3}, {0.6, -0.4, 0.8}, s.diffuse(0.8f));
  s.camera({0, 0.4, -1.5}, {0, -0.6, 0.8}, 50);
  return s;
}

TestScene with_light(LightKind light) {
  TestScene s = open_corner();
  s.scene.lights.push_back({std::move(light), {}});
  return s;
}

TestScene room_with(int material_of(TestScene&)) {
  TestScene s = cornell_room();
  s.sphere({-0.4, -0.6, 0.3}, 0.35, material_of(s));
  return s;
}

const std::vector<MatrixScene>& scenes() {
  static const std::vector<MatrixScene> all{
      {"diffuse room", area_light_sight(0, kDepth), [] { return cornell_room(); }},
      {"rough metal", area_light_sight(0, kDepth),
       [] { return room_with([](TestScene& s) { return s.conductor(0.9f, 0.4f); }); }},
      {"leaf", area_light_sight(0, kDepth),
       [] {
         return room_with([](TestScene& s) {
           return s.diffuse_transmission({0.3f, 0.4f, 0.2f}, {0.4f, 0.5f, 0.1f});
         });
       }},
      {"sphere light", area_light_sight(0, kDepth),
       [] {
         TestScene s = open_corner();
         s.sphere({-0.5, 0.2, 0.2}, 0.2, s.diffuse(0), {.radiance = {9, 6, 3}});
         return s;
       }},
      {"point light", delta_light_sight(1, kDepth),
       [] {
         return with_light(PointLight{{1, 2, 3}, {-0.5, 0.5, -0.2}});
       }},
      {"spot light", delta_light_sight(1, kDepth),
       [] {
         return with_light(SpotLight{{1, 2, 3}, {-0.5, 0.5, -0.2}, normalized({0.4, -1, 0.5}), 20, 40});
       }},
      {"distant light", delta_light_sight(1, kDepth),
       [] {
         return with_light(DistantLight{{1, 2, 3}, normalized({0.3, -1, 0.5})});
       }},
      {"environment", far_light_sight(0, kDepth),
       [] {
         return with_light(InfiniteLight{{1, 2, 3}, {}, {}});
       }},
      {"glass ball", specular_sight(),
       [] { return room_with([](TestScene& s) { return s.dielectric(1.5f, 0); }); }},
      {"orthographic view", area_light_sight(0, kDepth),
       [] {
         TestScene s = cornell_room();
         s.scene.camera.kind = CameraKind::kOrthographic;
         s.scene.camera.screen_window = std::array<double, 4>{-0.9, 0.9, -0.9, 0.9};
         return s;
       }},
  };
  return all;
}

double welch_z(const Estimate& a, const Estimate& b) {
  return std::copysign(normal_deviate(welch_p(a, b)), a.mean - b.mean);
}

}  // namespace

bool AgreementMatrix::passed() const { return worst < 4 && nonfinite == 0 && largest_error < 0.02; }

std::vector<std::string> matrix_scenes() {
  std::vector<std::string> names;
  for (const MatrixScene& s : scenes()) names.push_back(s.name);
  return names;
}

AgreementMatrix agreement_matrix(size_t index, bool full) {
  const MatrixScene& chosen = scenes().at(index);
  TestScene scene = chosen.build();
  scene.film(16, 16);
  AgreementMatrix m;
  m.scene = chosen.name;
  std::vector<std::array<Estimate, 3>> means;
  for (const Run& run : runs_that_see(chosen.sight, true)) {
    RenderSettings settings = settings_for(scene.scene, run.integrator, full ? 16 * kSpp : kSpp, kDepth,
                                           m.runs.size() + 1);  // a seed of its own
    if (run.strategies) settings.plan = SamplingPlan{.strategies = *run.strategies};
    const Batches b = render_batches(scene.scene, settings, kBatches);
    m.runs.push_back(run.name);
    m.nonfinite += b.counters.nonfinite;
    means.push_back({b.mean(0), b.mean(1), b.mean(2)});
    m.means.push_back(means.back()[0]);
    m.largest_error = std::max(m.largest_error, m.means.back().standard_error / m.means.back().mean);
    std::vector<double>& z = m.z.emplace_back();
    for (size_t j = 0; j + 1 < means.size(); ++j) {
      double worst = 0;
      for (size_t c = 0; c < 3; ++c) {
        const double zc = welch_z(means.back()[c], means[j][c]);
        if (std::fabs(zc) > std::fabs(worst)) worst = zc;
      }
      z.push_back(worst);
      m.worst = std::max(m.worst, std::fabs(worst));
    }
  }
  return m;
}

std::string matrix_text(const AgreementMatrix& m) {
  char line[160];
  std::snprintf(line, sizeof line, "%s: largest |z| %.2f, noisiest run %.2g %%, %llu non-finite: %s\n",
                m.scene.c_str(), m.worst, 100 * m.largest_error, static_cast<unsigned long long>(m.nonfinite),
                m.passed() ? "pass" : "FAIL");
  std::string out = line;
  for (size_t i = 0; i < m.runs.size(); ++i) {
    std::snprintf(line, sizeof line, "  %-26s %11.6g ", m.runs[i].c_str(), m.means[i].mean);
    out += line;
    for (const double z : m.z[i]) {
      std::snprintf(line, sizeof line, " %5.1f", z);
      out += line;
    }
    out += '\n';
  }
  return out;
}

}  // namespace lightmill::test
