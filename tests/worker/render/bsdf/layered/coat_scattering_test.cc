// Coats that scatter, against a random walk through interface, medium and base that is written again here,
// and against what is known exactly.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/layered/coat_transfer.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

struct Layers {
  float eta, coat_alpha, thickness, albedo, g;
  float base;  // reflectance, of a Lambertian base or of the metal at every angle
  bool metal;
  float metal_alpha;
};

/// A direction at the angle that Henyey-Greenstein's function draws, round `w`.
Vec3<float> scatter(const Vec3<float>& w, double g, Random& random) {
  const double u = random.uniform(), phi = 2 * M_PI * random.uniform();
  const double s = std::fabs(g) < 1e-3 ? 0 : (1 - g * g) / (1 - g + 2 * g * u);
  const double c = std::fabs(g) < 1e-3 ? 2 * u - 1 : (1 + g * g - s * s) / (2 * g);
  const double sine = std::sqrt(std::max(0.0, 1 - c * c));
  const Vec3<float> axis = std::fabs(w.x) < 0.6f ? Vec3<float>{1, 0, 0} : Vec3<float>{0, 1, 0};
  const Vec3<float> a = normalize(cross(w, axis)), b = cross(w, a);
  return a * static_cast<float>(sine * std::cos(phi)) + b * static_cast<float>(sine * std::sin(phi)) +
         w * static_cast<float>(c);
}

/// What leaves the layers per unit of light that arrives along `wo`, and whither.
float walk(const Layers& layers, const Vec3<float>& wo, Random& random, Vec3<float>* out) {
  BsdfParams<float> coat, base;
  coat.p[0] = layers.eta;
  coat.p[6] = layers.coat_alpha;
  const auto meet_coat = [&](const Vec3<float>& from) {
    const float lobe = random.uniform(), u = random.uniform(), v = random.uniform();
    return sample_bsdf<float>(layers.coat_alpha > 0 ? kRoughDielectric : kSmoothDielectric, true, coat, from,
                              lobe, u, v, Mode::kImportance);
  };
  BsdfSample<float> s = meet_coat(wo);
  float weight = s.weight.x;
  Vec3<float> w = s.wi;
  if (!s.valid) return 0;
  double depth = 0;  // optical, below the interface
  while (w.z <= 0 || depth > 0) {
    const double step = -std::log(1 - double{random.uniform()}) * w.z;
    depth -= step;
    if (depth > 0 && depth < layers.thickness) {
      weight *= layers.albedo;
      w = scatter(w, layers.g, random);
    } else if (depth <= 0) {
      depth = 0;
      s = meet_coat(-w);
      if (!s.valid) return 0;
      weight *= s.weight.x;
      w = s.wi;
      if (w.z > 0) break;
    } else {
      depth = layers.thickness;
      const float u = random.uniform(), v = random.uniform();
      if (!layers.metal) {
        w = square_to_cosine_hemisphere(u, v);
        weight *= layers.base;
      } else {
        const Vec3<float> m = coat_facet(layers.metal_alpha, -w, u, v);
        const Vec3<float> up = w - m * (2 * dot(w, m));
        if (up.z <= 0) return 0;
        weight *= layers.base * coat_unmasked(layers.metal_alpha, -w, up);
        w = up;
      }
    }
    if (weight < 0.1f) {
      if (random.uniform() >= 0.5f) return 0;
      weight *= 2;
    }
  }
  *out = w;
  return weight;
}

TestScene scene_of(const Layers& layers) {
  TestScene s;
  const Rgb base{layers.base, layers.base, layers.base};
  const CoatMediumDescription medium{{layers.albedo, layers.albedo, layers.albedo}, layers.g};
  if (layers.metal) {
    s.coated_conductor(base, layers.eta, layers.coat_alpha, layers.metal_alpha);
    auto& m = std::get<CoatedConductorMaterial>(s.scene.materials[0].kind);
    m.medium = medium;
    m.thickness = layers.thickness;
    m.max_depth = 1000;
  } else {
    s.coated(base, layers.eta, layers.coat_alpha);
    auto& m = std::get<CoatedDiffuseMaterial>(s.scene.materials[0].kind);
    m.medium = medium;
    m.thickness = layers.thickness;
    m.max_depth = 1000;
  }
  return s;
}

/// What leaves in all, and how much of it goes on forwards rather than back.
struct Leaving {
  double all = 0, forwards = 0;
};
template <class Fn>
Leaving leaving(int n, Fn&& one) {
  Leaving sum;
  for (int i = 0; i < n; ++i) {
    Vec3<float> wi{};
    const double weight = one(&wi);
    sum.all += weight / n;
    if (wi.x < 0) sum.forwards += weight / n;
  }
  return sum;
}

void compare(const Layers& layers, double tolerance, const std::string& name) {
  const TestScene s = scene_of(layers);
  const RenderScene scene = build_scene(s.scene);
  BsdfCase model{"", scene.material_kind[0], {}, 0};
  for (size_t k = 0; k < kBsdfParams; ++k) model.params.p[k] = scene.material_params[k];
  model.params.tables = scene.bsdf_tables.data();
  for (const double degrees : {0.0, 40.0, 70.0}) {
    const Vec3<float> wo = direction_at(degrees);
    Random r1(1), r2(2);
    const Leaving w = leaving(40000, [&](Vec3<float>* wi) { return walk(layers, wo, r1, wi); });
    const Leaving m = leaving(40000, [&](Vec3<float>* wi) {
      const BsdfSample<float> b = model.sample(wo, r2, Mode::kImportance);
      *wi = b.wi;
      return b.valid ? b.weight.x : 0;
    });
    EXPECT_NEAR(m.all, w.all, tolerance) << name << " at " << degrees;
    EXPECT_NEAR(m.forwards, w.forwards, 1.5 * tolerance) << name << " forwards at " << degrees;
  }
}

// 0.01 is three standard errors of the two estimates' difference.
TEST(CoatScattering, OverADiffuseBaseAsTheWalk) {
  for (const float thickness : {0.05f, 0.5f, 4.0f}) {
    for (const float g : {-0.5f, 0.0f, 0.8f}) {
      for (const float base : {0.0f, 0.7f}) {
        compare({1.5f, 0, thickness, 0.9f, g, base, false, 0}, 0.01,
                "thickness " + std::to_string(thickness) + " g " + std::to_string(g) + " base " +
                    std::to_string(base));
      }
    }
  }
}

TEST(CoatScattering, UnderARoughInterfaceAsTheWalk) {
  for (const float eta : {1.2f, 1.5f, 2.0f}) {
    for (const float alpha : {0.1f, 0.4f}) {
      compare({eta, alpha, 0.5f, 0.9f, 0.3f, 0.5f, false, 0}, 0.015,
              "eta " + std::to_string(eta) + " alpha " + std::to_string(alpha));
    }
  }
}

TEST(CoatScattering, OverAMetalAsTheWalk) {
  for (const float coat : {0.0f, 0.2f}) {
    for (const float metal : {0.1f, 0.4f}) {
      // A reflectance near 1 hardly depends on the angle, as in the walk.
      compare({1.5f, coat, 0.5f, 0.9f, 0.3f, 0.99f, true, metal}, 0.03,
              "coat " + std::to_string(coat) + " metal " + std::to_string(metal));
    }
  }
}

// Nothing absorbs: all that enters leaves again, in every direction.
TEST(CoatScattering, LosslessCoatsAndBasesStayWhite) {
  for (const float thickness : {0.01f, 0.5f, 30.0f}) {
    for (const float g : {0.0f, 0.7f}) {
      const TestScene s = scene_of({1.5f, 0, thickness, 1, g, 1, false, 0});
      const RenderScene scene = build_scene(s.scene);
      BsdfCase model{"", scene.material_kind[0], {}, 0};
      for (size_t k = 0; k < kBsdfParams; ++k) model.params.p[k] = scene.material_params[k];
      model.params.tables = scene.bsdf_tables.data();
      for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
        Random random(3);
        const Leaving m = leaving(60000, [&](Vec3<float>* wi) {
          const BsdfSample<float> b = model.sample(direction_at(degrees), random, Mode::kImportance);
          *wi = b.wi;
          return b.valid ? b.weight.x : 0;
        });
        EXPECT_NEAR(m.all, 1, 0.01) << "thickness " << thickness << " g " << g << " at " << degrees;
      }
    }
  }
}

// Without absorption what a layer reflects and transmits is all there is. An isotropic layer of thickness 1
// lets 0.5532 of diffuse light through: the problem is that of radiative equilibrium between black walls
// (Heaslet and Warming 1965, table 2).
TEST(CoatScattering, SlabsKeepEnergy) {
  const Streams& s = streams();
  for (const double g : {0.0, 0.9, -0.6}) {
    for (const double thickness : {1e-4, 1.0, 100.0}) {
      const Slab slab = scattering_slab(thickness, 1, g);
      for (size_t j = 0; j < kStreams; ++j) {
        double sum = 0;
        for (size_t i = 0; i < kStreams; ++i) sum += slab.reflect[i][j] + slab.transmit[i][j];
        EXPECT_NEAR(sum, 1, 1e-3) << "g " << g << " thickness " << thickness << " stream " << j;
      }
    }
  }
  const Slab slab = scattering_slab(1, 1, 0);
  double reflected = 0;
  for (size_t j = 0; j < kStreams; ++j) {
    for (size_t i = 0; i < kStreams; ++i) reflected += slab.reflect[i][j] * 2 * s.cosine[j] * s.weight[j];
  }
  EXPECT_NEAR(reflected, 1 - 0.5532, 1e-3);
}

}  // namespace
}  // namespace lightmill::test
