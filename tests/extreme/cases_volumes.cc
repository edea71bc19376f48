// Media that vary over a grid: the integral of their density, furnaces, single scattering and emission.
#include <cmath>

#include "tests/extreme/case.h"
#include "tests/support/volumes.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill::test {
namespace {

/// A density between z = 0 and 1 whose integral is 1 or nearly so.
struct Profile {
  const char* name;
  double (*density)(double z);
};
const Profile kProfiles[] = {
    {"linear", [](double z) { return 2 * z; }},
    {"exponential", [](double z) { return 4 * std::exp(-4 * z); }},
    {"step", [](double z) { return z < 0.5 ? 1e-3 : 1.999; }},
    {"spike", [](double z) { return std::fabs(z - 0.5) < 0.02 ? 41.0 : 0.0; }},
};
constexpr int kVoxels = 41;

/// Of what is interpolated between the voxels: it begins to fall off half a voxel before the faces.
double integral(const Profile& profile) {
  double sum = 0;
  for (int i = 0; i < kVoxels; ++i)
    sum += (i == 0 || i == kVoxels - 1 ? 0.875 : 1) * profile.density((i + 0.5) / kVoxels) / kVoxels;
  return sum;
}

/// Of what has not scattered, through a slab of thickness 1 that a parallel view crosses straight.
Case slab(const Profile& profile, float depth, bool scatters) {
  Case c{"25 slab of a grid",
         std::string(profile.name) + ", optical depth " + text(depth) +
             (scatters ? ", scattering" : ", absorbing"),
         "L exp(-integral)", area_light_sight(0, 0), [profile, depth, scatters] {
           TestScene s;
           s.quad({-2, -2, 2}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0), {.radiance = {1, 2, 3}});
           const auto density = field_of({2, 2, kVoxels, {-40, -40, 0.5}, {40, 40, 1.5}},
                                         [&](double, double, double z) { return profile.density(z - 0.5); });
           const Rgb k{depth, depth, depth};
           const int medium =
               add_grid_medium(&s, scatters ? Rgb{} : k, scatters ? k : Rgb{}, grid_of(density));
           bounding_box(&s, {-8, -8, 0.25}, {8, 8, 1.75}, medium);
           s.camera({0, 0, 0}, {0, 0, 1}, 90).film(16, 16);
           s.scene.camera.kind = CameraKind::kOrthographic;
           const double t = std::exp(-double{depth} * integral(profile));
           return Setup{s.scene, 0, {t, 2 * t, 3 * t}, 1e-4};
         }};
  c.every_set = profile.density == kProfiles[0].density;
  return c;
}

std::shared_ptr<const VolumeField> random_field(int voxels, double half) {
  uint32_t voxel = 0;
  return field_of({voxels, voxels, voxels, {-half, -half, -half}, {half, half, half}},
                  [&](double, double, double) { return unit_float<float>(hash32(++voxel)); });
}

/// An emitting black box full of smoke that absorbs nothing.
Case furnace(int voxels, float depth, float g) {
  Case c{"26 furnace with a grid",
         std::to_string(voxels) + " voxels a side, optical depth " + text(depth) + ", g " + text(g), "L",
         area_light_sight(0, kUnlimitedDepth), [voxels, depth, g] {
           TestScene s;
           s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0), {.radiance = {1, 0.5f, 2}, .inward = true});
           const Rgb k{depth, depth / 2, depth / 4};
           const int medium = add_grid_medium(&s, {}, k, grid_of(random_field(voxels, 1)), g);
           for (ShapeDescription& shape : s.scene.shapes) shape.media = {medium, medium};
           s.scene.camera.medium = medium;
           s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 90).film(16, 16);
           return Setup{s.scene, kUnlimitedDepth, {1, 0.5, 2}, 2e-4};
         }};
  c.pt_only = depth > 4;
  if (depth > 4) {
    c.notes.push_back({Note::kSkip, kNextEvent, "hundreds of events per path"});
    c.notes.push_back({Note::kSkip, kEmissionHits | kNextEvent, "hundreds of events per light path"});
    c.notes.push_back({Note::kSkip, kEmissionHits, "light that the medium all but hides from every event"});
  } else {
    c.notes.push_back({Note::kSkip, kEmissionHits | kNextEvent,
                       "light paths that scatter next to the lens have infinite variance"});
  }
  return c;
}

/// A density that is linear along z, (z + 1) / 2, whatever the voxels.
std::shared_ptr<const MediumGrid> linear_grid(int voxels) {
  auto grid = grid_of(field_of({3, 3, voxels, {-4, -4, -1}, {4, 4, 5}},
                               [](double, double, double z) { return (z + 1) / 2; }));
  grid->lo = {-2, -2, 0}, grid->hi = {2, 2, 4};
  return grid;
}
double mean_density(double z0, double z1) { return (z0 + z1 + 2) / 4; }

/// One event of a point light's or the sun's light on the camera's axis from z = 0.1 to 3.
Case single_scattering(int voxels, double sigma, float g, bool sun) {
  Case c{sun ? "27 a sun in a grid" : "27 a point light in a grid",
         "sigma " + text(sigma) + ", g " + text(g) + ", " + std::to_string(voxels) + " voxels", "quadrature",
         without_lens(delta_light_sight(1, 1)), [voxels, sigma, g, sun] {
           TestScene s;
           const auto f = static_cast<float>(sigma);
           const int smoke =
               add_grid_medium(&s, {0.2f * f, 0.2f * f, 0.2f * f}, {f, f, f}, linear_grid(voxels), g);
           bounding_box(&s, {-1.5, -1.5, 0.1}, {1.5, 1.5, 3}, smoke);
           if (sun) {
             s.scene.lights.push_back({DistantLight{{1, 1, 1}, {-1, 0, 0}}, {}});
           } else {
             s.point_light({0.8, 0, 1.5}, {1, 1, 1});
             s.scene.lights.back().medium = smoke;
           }
           s.camera({0, 0, 0}, {0, 0, 1}, 0.01).film(16, 16);
           constexpr int kSteps = 20000;
           double exact = 0;
           for (int i = 0; i < kSteps; ++i) {
             const double z = 0.1 + 2.9 * (i + 0.5) / kSteps;
             const double r = sun ? 1.5 : std::hypot(0.8, z - 1.5);
             const double depth =
                 1.2 * sigma * ((z - 0.1) * mean_density(0.1, z) + r * mean_density(z, sun ? z : 1.5));
             const double cosine = sun ? 0 : -(z - 1.5) / r;
             const double phase =
                 (1 - double{g} * g) / (4 * M_PI * std::pow(1 + double{g} * g - 2 * g * cosine, 1.5));
             exact +=
                 sigma * mean_density(z, z) * phase * std::exp(-depth) / (sun ? 1 : r * r) * 2.9 / kSteps;
           }
           return Setup{s.scene, 1, grey(exact), 1e-3};
         }};
  return c;
}

/// What a grid of no or some scattering shows of its own light.
Case emission(float sigma, bool scatters) {
  return {"28 a grid that shines", "sigma " + text(sigma) + (scatters ? ", scattering" : ""), "quadrature",
          only_hits(0), [sigma, scatters] {
            TestScene s;
            auto grid = std::make_shared<MediumGrid>(*linear_grid(13));
            grid->emission =
                field_of({3, 3, 13, {-4, -4, -1}, {4, 4, 5}}, [](double, double, double z) { return 2 + z; });
            const float b = scatters ? sigma : 0;
            const int medium = add_grid_medium(&s, {sigma, sigma, sigma}, {b, b, b}, grid, 0, {1, 1, 1});
            bounding_box(&s, {-1, -1, 1}, {1, 1, 3}, medium);
            s.point_light({0, 9, 0}, {1, 1, 1});
            s.camera({0, 0, 0}, {0, 0, 1}, 0.01).film(16, 16);
            constexpr int kSteps = 20000;
            double exact = 0;
            for (int i = 0; i < kSteps; ++i) {
              const double z = 1 + 2 * (i + 0.5) / kSteps;
              exact += std::exp(-(double{sigma} + b) * (z - 1) * mean_density(1, z)) * sigma *
                       mean_density(z, z) * (2 + z) * 2 / kSteps;
            }
            return Setup{s.scene, 0, grey(exact), 1e-3};
          }};
}

/// What a floor gets from a grid that shines, 1 to 3 in depth, and reflects once.
Case lit_floor(float sigma) {
  return {"29 a floor by a grid that shines", "sigma " + text(sigma), "quadrature",
          without_lens(area_light_sight(1, 1)), [sigma] {
            constexpr float kRho = 0.7f;
            TestScene s;
            auto grid = std::make_shared<MediumGrid>(*linear_grid(13));
            grid->emission =
                field_of({3, 3, 13, {-4, -4, -1}, {4, 4, 5}}, [](double, double, double z) { return 2 + z; });
            const int medium = add_grid_medium(&s, {sigma, sigma, sigma}, {}, grid, 0, {1, 1, 1});
            bounding_box(&s, {-1, -1, 1}, {1, 1, 3}, medium);
            s.quad({-9, -2, -9}, {0, 0, 18}, {18, 0, 0}, s.diffuse(kRho));
            s.camera({0, -1.2, -6}, {0, -2, 2}, 0.01).film(16, 16);
            const Vec3d p{0, -2, 2};
            constexpr int kSide = 40,
                          kLayers = 600;  // the light of thick grids comes from their lowest layers
            double sum = 0;
            for (int k = 0; k < kLayers; ++k) {
              for (int i = 0; i < kSide; ++i) {
                for (int j = 0; j < kSide; ++j) {
                  // Layers are thinner below.
                  const double u = (k + 0.5) / kLayers, v = 6 * u * u * u * u * u / kLayers;
                  const Vec3d x{-1 + 2 * (i + 0.5) / kSide, -1 + 2 * u * u * u * u * u * u,
                                1 + 2 * (j + 0.5) / kSide};
                  const Vec3d way = p - x;
                  const double d2 = dot(way, way), d = std::sqrt(d2);
                  // From x to where the way leaves by the lowest face, the only one that p sees.
                  const double out = (-1 - x.y) / way.y, z = x.z + out * way.z;
                  const double depth = sigma * mean_density(x.z, z) * out * d;
                  const double cosine = -way.y / d;
                  sum += sigma * mean_density(x.z, x.z) * (2 + x.z) * std::exp(-depth) * cosine / d2 * 2 * v *
                         4 / (kSide * kSide);
                }
              }
            }
            return Setup{s.scene, 1, grey(kRho / M_PI * sum), 2e-3};
          }};
}

}  // namespace

std::vector<Case> volume_cases() {
  std::vector<Case> cases;
  for (const Profile& profile : kProfiles) {
    for (const float depth : {1e-6f, 1e-3f, 1.0f, 16.0f}) cases.push_back(slab(profile, depth, false));
    for (const float depth : {1e-6f, 1e-3f, 1.0f, 4.0f}) cases.push_back(slab(profile, depth, true));
  }
  for (const int voxels : {1, 5, 40}) {
    for (const float depth : {1e-6f, 1.0f, 50.0f}) {
      for (const float g : {0.0f, 0.95f}) cases.push_back(furnace(voxels, depth, g));
    }
  }
  for (const int voxels : {6, 95}) {
    for (const double sigma : {0.02, 1.0, 20.0}) {
      for (const float g : {0.0f, 0.8f}) {
        for (const bool sun : {false, true}) cases.push_back(single_scattering(voxels, sigma, g, sun));
      }
    }
  }
  for (const float sigma : {1e-6f, 0.1f, 2.0f, 100.0f}) {
    for (const bool scatters : {false, true}) cases.push_back(emission(sigma, scatters));
  }
  for (const float sigma : {1e-6f, 0.1f, 2.0f, 10.0f}) cases.push_back(lit_floor(sigma));
  return cases;
}

}  // namespace lightmill::test
