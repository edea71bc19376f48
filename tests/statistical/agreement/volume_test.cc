// Media that vary over a grid: closed answers by every estimator that sees the light, and the agreement of
// all sets of strategy families in a room with smoke.
//
// alpha = 1e-4 per comparison; `resolution` states the error that a comparison would notice.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/statistical/agreement/strategy_set.h"
#include "tests/statistical/oracles/over_film.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/volumes.h"
#include "worker/render/renderer.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

class Volumes : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
  double resolution(double of_pt) const { return GetParam() == Integrator::kLt ? 3 * of_pt : of_pt; }
};

/// A profile along z between 0 and 1, and its integral over [0, 1].
struct Profile {
  const char* name;
  double (*density)(double z);
};
const Profile kProfiles[] = {
    {"even", [](double) { return 1.0; }},
    {"linear", [](double z) { return 2 * z; }},
    {"exponential", [](double z) { return std::exp(-4 * z) * 4; }},
    {"step", [](double z) { return z < 0.5 ? 0.05 : 1.95; }},
    {"spike", [](double z) { return std::fabs(z - 0.5) < 0.02 ? 25.0 : 0.0; }},
};

// A wall that shines, seen through a slab whose density varies along the view.
TEST_P(Volumes, SlabsTransmitByTheirIntegral) {
  constexpr int kVoxels = 33;
  for (const Profile& profile : kProfiles) {
    // Of the interpolated values: it falls off to 0 from half a voxel before the faces to half a one beyond.
    double integral = 0;
    for (int i = 0; i < kVoxels; ++i) {
      const double end = i == 0 || i == kVoxels - 1 ? 1 - 0.125 : 1;
      integral += end * profile.density((i + 0.5) / kVoxels) / kVoxels;
    }
    for (const float sigma : {1e-6f, 0.3f, 4.0f}) {
      for (const bool scatters : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << profile.name << ", sigma " << sigma << (scatters ? ", scattering" : ", absorbing"));
        TestScene s;
        s.quad({-2, -2, 2}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0), {.radiance = {1, 2, 3}});
        const GridBox box{4, 4, kVoxels, {-40, -40, 0.5}, {40, 40, 1.5}};
        const auto density =
            field_of(box, [&](double, double, double z) { return profile.density(z - 0.5); });
        const Rgb coefficient{sigma, sigma / 2, sigma / 4};
        const int medium = scatters ? add_grid_medium(&s, {}, coefficient, grid_of(density))
                                    : add_grid_medium(&s, coefficient, {}, grid_of(density));
        bounding_box(&s, {-8, -8, 0.25}, {8, 8, 1.75}, medium);
        s.camera({0, 0, 0}, {0, 0, 1}, 90).film(8, 8);
        s.scene.camera.kind = CameraKind::kOrthographic;
        const Batches b = render(s, 0, scatters ? 1024 : 256);
        for (int c = 0; c < 3; ++c) {
          const double exact = (1 + c) * std::exp(-double{sigma} * std::ldexp(1.0, -c) * integral);
          EXPECT_TRUE(mean_is(b.mean(c), exact, {.resolution = resolution(0.1), .rounding = 2e-4}))
              << "channel " << c;
        }
      }
    }
  }
}

// Where nothing is absorbed, what comes out of an even surrounding is the same from everywhere.
TEST_P(Volumes, NothingIsLostWhereNothingIsAbsorbed) {
  constexpr int kVoxels = 19;
  for (const float depth : {0.1f, 3.0f, 20.0f}) {
    for (const float g : {0.0f, 0.9f}) {
      SCOPED_TRACE(testing::Message() << "optical depth " << depth << " g " << g);
      if (GetParam() == Integrator::kLt && (depth > 1 || g > 0.5f)) continue;  // rare bright events
      if (GetParam() == Integrator::kBdpt && depth > 10) continue;
      TestScene s;
      s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0), {.radiance = {1, 1, 1}, .inward = true});
      int voxel = 0;
      const auto density = field_of({kVoxels, kVoxels, kVoxels, {-1, -1, -1}, {1, 1, 1}},
                                    [&](double, double, double) { return random_density(voxel++, 0, 0, 1); });
      const int smoke = add_grid_medium(&s, {}, {depth, 2 * depth, depth / 2}, grid_of(density), g);
      for (ShapeDescription& shape : s.scene.shapes) shape.media = {smoke, smoke};
      s.scene.camera.medium = smoke;
      s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(8, 8);
      const Batches b = render(s, kUnlimitedDepth, 512);
      for (int c = 0; c < 3; ++c)
        EXPECT_TRUE(mean_is(b.mean(c), 1, {.resolution = resolution(0.15), .rounding = 1e-4})) << c;
    }
  }
}

/// A ball of smoke over a floor under a point light: `medium` has a box of 1.6 around it.
TestScene over_floor() {
  TestScene s;
  s.quad({-3, -0.9, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.6f));
  s.point_light({1.5, 2, -1}, {6, 6, 6});
  s.camera({0, 0.6, -4}, {0, -0.1, 0}, 35).film(16, 16);
  return s;
}

// The same medium as an even one and as a grid: tracked, integrated, and with coefficients of its own.
TEST_P(Volumes, AnEvenGridIsAHomogeneousMedium) {
  const Rgb a{0.3f, 0.6f, 0.1f}, b{1.5f, 1, 2.5f};
  const auto with = [&](auto&& add) {
    TestScene s = over_floor();
    bounding_box(&s, {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}, add(&s));
    return s;
  };
  const auto even = [&](TestScene* s) {
    s->scene.media.push_back({"", a, b, {}, 0.3f, {}});
    return 0;
  };
  const auto grid = [&](TestScene* s) {
    // Half of the density in a corner voxel far away makes all bricks but one track null collisions.
    const auto density =
        field_of({3, 3, 3, {-0.9, -0.9, -0.9}, {0.9, 0.9, 0.9}, 1}, [](double, double, double) { return 1; });
    return add_grid_medium(s, a, b, grid_of(density), 0.3f);
  };
  const auto dense_bricks = [&](TestScene* s) {
    // A spike outside of the boundary makes the bricks of it dense: they are integrated.
    const auto density = field_of({9, 9, 9, {-1.8, -1.8, -1.8}, {1.8, 1.8, 1.8}, 1},
                                  [](double x, double y, double) { return x < -1.5 && y < -1.5 ? 1e5 : 1; });
    return add_grid_medium(s, a, b, grid_of(density), 0.3f);
  };
  const auto own = [&](TestScene* s) {
    const auto rgb = [&](const Rgb& c) {
      auto f = std::make_shared<VolumeField>();
      f->nx = f->ny = f->nz = 2;
      f->channels = 3;
      f->lo = {-1.6, -1.6, -1.6}, f->hi = {1.6, 1.6, 1.6};  // so that nothing falls off within the boundary
      for (int i = 0; i < 8; ++i) f->values.insert(f->values.end(), {c.r, c.g, c.b});
      return f;
    };
    auto g = std::make_shared<MediumGrid>();
    g->lo = {-0.9, -0.9, -0.9}, g->hi = {0.9, 0.9, 0.9};
    g->sigma_a = rgb(a), g->sigma_s = rgb(b);
    return add_grid_medium(s, {}, {}, g, 0.3f);
  };
  const int64_t spp = GetParam() == Integrator::kLt ? 4096 : 1024;
  const Batches expected = render(with(even), 4, spp);
  const std::pair<const char*, Batches> others[] = {{"grid", render(with(grid), 4, spp)},
                                                    {"dense bricks", render(with(dense_bricks), 4, spp)},
                                                    {"coefficients of its own", render(with(own), 4, spp)}};
  for (const auto& [name, image] : others) {
    for (int c = 0; c < 3; ++c)
      EXPECT_TRUE(means_agree(expected.mean(c), image.mean(c), {.resolution = resolution(0.05)}))
          << name << " " << c;
  }
}

/// A density that is linear along z: what interpolation makes of it does not depend on the voxels.
std::shared_ptr<const MediumGrid> linear_grid(int voxels, double most) {
  auto density = field_of({3, 3, voxels, {-4, -4, -1}, {4, 4, 5}},
                          [&](double, double, double z) { return most * (z + 1) / 6; });
  auto grid = grid_of(density);
  grid->lo = {-2, -2, 0}, grid->hi = {2, 2, 4};  // within half a voxel from the faces it would fall off
  return grid;
}

// Single scattering of a point light in smoke between black walls, against quadrature.
TEST_P(Volumes, SingleScatteringIsItsIntegral) {
  for (const int voxels : {6, 97}) {
    for (const float sigma : {0.05f, 1.0f}) {
      for (const float g : {-0.5f, 0.0f, 0.6f}) {
        if (GetParam() == Integrator::kLt && (sigma < 1 || g > 0))
          continue;  // few light paths scatter, or back
        SCOPED_TRACE(testing::Message() << voxels << " voxels, sigma " << sigma << ", g " << g);
        TestScene s;
        s.box({-1.5, -1.5, 0.01}, {1.5, 1.5, 3}, s.diffuse(0), {.inward = true});
        const int smoke = add_grid_medium(&s, {0.3f * sigma, 0, 0.1f * sigma},
                                          {0.7f * sigma, sigma, 0.2f * sigma}, linear_grid(voxels, 3), g);
        s.scene.camera.medium = smoke;
        const Vec3d light{0.8, 0, 1.5};
        s.point_light(light, {1, 1, 1});
        s.scene.lights.back().medium = smoke;
        s.camera({0, 0, 0.02}, {0, 0, 1}, 25).film(8, 8);
        const Batches image = render(s, 1, sigma < 0.1f ? 8192 : 2048);
        const double sa[3] = {0.3 * sigma, 0, 0.1 * sigma}, ss[3] = {0.7 * sigma, sigma, 0.2 * sigma};
        for (int c = 0; c < 3; ++c) {
          // The density at z is (z + 1) / 2; its integral along a straight way is the mean of the ends'
          // values.
          const auto d = [](double z) { return (z + 1) / 2; };
          const double exact = over_film(s, [&](const Vec3d& w) {
            const double end = std::min({2.98 / w.z, 1.5 / std::abs(w.x), 1.5 / std::abs(w.y)});
            constexpr int kSteps = 200;
            double sum = 0;
            for (int i = 0; i < kSteps; ++i) {
              const double t = end * (i + 0.5) / kSteps;
              const Vec3d p = Vec3d{0, 0, 0.02} + w * t, to_light = light - p;
              const double r = length(to_light);
              const double depth = (sa[c] + ss[c]) * (t * (d(0.02) + d(p.z)) + r * (d(p.z) + d(1.5))) / 2;
              const double cosine = dot(w, to_light) / r;
              const double phase = (1 - g * g) / (4 * M_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
              sum += ss[c] * d(p.z) * phase * std::exp(-depth) / (r * r) * end / kSteps;
            }
            return sum;
          });
          EXPECT_TRUE(mean_is(image.mean(c), exact, {.resolution = resolution(0.1), .rounding = 2e-3}))
              << "channel " << c;
        }
      }
    }
  }
}

// What glows: by a factor, by its temperature and in colours of its own, with and without scattering.
TEST(VolumeEmission, IsItsIntegral) {
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
    for (const bool scatters : {false, true}) {
      for (const float sigma : {1e-3f, 0.5f, 30.0f}) {
        SCOPED_TRACE(testing::Message()
                     << name_of(integrator) << (scatters ? ", scattering" : "") << ", sigma " << sigma);
        TestScene s;
        const GridBox box{3, 3, 13, {-4, -4, -1}, {4, 4, 5}};
        auto grid = std::make_shared<MediumGrid>(*linear_grid(13, 3));
        grid->emission = field_of(box, [](double, double, double z) { return 2 + z; });
        const float a = sigma, b = scatters ? sigma / 2 : 0;
        const int medium = add_grid_medium(&s, {a, a / 2, 0}, {b, b, b}, grid, 0, {1, 2, 3});
        bounding_box(&s, {-1, -1, 1}, {1, 1, 3}, medium);
        s.point_light({0, 9, 0}, {1, 1, 1});  // not seen: no event is counted
        s.camera({0, 0, 0}, {0, 0, 1}, 0.01).film(8, 8);
        const Batches image = render_batches(
            s.scene, settings_for(s.scene, integrator, sigma < 0.1f ? 4096 : 1024, 0), kBatches);
        for (int c = 0; c < 2; ++c) {
          const double absorption = c == 0 ? a : a / 2, extinction = absorption + b;
          constexpr int kSteps = 4000;
          double exact = 0;
          for (int i = 0; i < kSteps; ++i) {
            const double z = 1 + 2 * (i + 0.5) / kSteps, density = (z + 1) / 2;
            const double depth = extinction * (z - 1) * (1 + density) / 2;
            exact += std::exp(-depth) * absorption * density * (1 + c) * (2 + z) * 2 / kSteps;
          }
          EXPECT_TRUE(mean_is(image.mean(c), exact, {.resolution = 0.1, .rounding = 1e-3}))
              << "channel " << c;
        }
        EXPECT_EQ(image.mean(2).mean, 0);
      }
    }
  }
}

/// A room full of thin coloured smoke that thickens to one side, with a dense cloud in it that glows a
/// little.
TestScene smoky_room() {
  TestScene s = cornell_room();
  int voxel = 0;
  const auto thin = field_of({7, 5, 6, {-1, -1, -1}, {1, 1, 1}, 0.2f},
                             [](double x, double y, double) { return 1 + 0.5 * x - 0.3 * y; });
  const auto dense = field_of({11, 11, 11, {-0.8, -0.8, -0.15}, {0.1, 0.1, 0.75}},
                              [&](double, double, double) { return random_density(voxel++, 7, 3, 1); });
  const int smoke = add_grid_medium(&s, {0.02f, 0.05f, 0.1f}, {0.5f, 0.3f, 0.2f}, grid_of(thin), 0.4f);
  const int cloud = add_grid_medium(&s, {0, 0.2f, 0.4f}, {6, 4, 8}, grid_of(dense), -0.3f);
  for (ShapeDescription& shape : s.scene.shapes) shape.media = {smoke, smoke};
  s.scene.camera.medium = smoke;
  const size_t first = s.scene.shapes.size();
  s.sphere({-0.35, -0.4, 0.3}, 0.45, 0);
  s.scene.shapes[first].media = {cloud, smoke};
  s.scene.shapes[first].boundary = true;
  s.sphere({-0.35, -0.4, 0.3}, 0.15, s.diffuse(0.8f));
  s.scene.shapes.back().media = {-1, cloud};
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(16, 16);  // the lamp is out of sight
  return s;
}

class VolumeStrategySet : public ::testing::TestWithParam<unsigned> {};

TEST_P(VolumeStrategySet, AgreesInASmokyRoom) {
  expect_agrees_with_all(smoky_room(), GetParam(),
                         {.max_depth = 5,
                          .spp = 3072,
                          .weak_spp = 4096,
                          .once_spp = 512,
                          .notice = 1.1f,
                          .connections_notice = 1.25f});
}

/// A closed room with nothing but a fire under its ceiling, out of sight. A ball cuts it out of its grid, and
/// another one stands in it.
TestScene room_with_fire() {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.6f), {.inward = true});
  int voxel = 0;
  const GridBox box{17, 11, 13, {-0.4, 0.2, -0.3}, {0.6, 0.95, 0.7}};
  auto fire = std::make_shared<MediumGrid>(
      *grid_of(field_of(box, [&](double, double, double) { return random_density(voxel++, 1, 2, 1); })));
  fire->emission = field_of(box, [](double x, double y, double) { return x > 0.3 ? 8 : 1 + y; });
  const int burning = add_grid_medium(&s, {2, 3, 1}, {1, 1, 3}, fire, 0.3f, {4, 2, 1});
  const size_t first = s.scene.shapes.size();
  s.sphere({0.15, 0.6, 0.2}, 0.3, 0);
  s.scene.shapes[first].media = {burning, -1};
  s.scene.shapes[first].boundary = true;
  s.sphere({0.2, 0.65, 0.25}, 0.1, s.diffuse(0.8f));
  s.scene.shapes.back().media = {burning, burning};
  s.camera({0, 0.1, -0.95}, {0, -1, 0.3}, 70).film(16, 16);
  return s;
}

TEST_P(VolumeStrategySet, AgreesInARoomWithFire) {
  // Next to a point of the fire next-event estimation alone has no finite variance.
  expect_agrees_with_all(room_with_fire(), GetParam(),
                         {.max_depth = 5,
                          .spp = 3072,
                          .weak_spp = 4096,
                          .once_spp = 512,
                          .notice = GetParam() == kNextEvent ? 1.3f : 1.1f,
                          .connections_notice = 1.25f});
}

// Coefficients are per length: with 2^-k of them, a scene 2^k times as large has the same bits.
TEST(VolumeScale, PowersOfTwoChangeNoBit) {
  const TestScene s = smoky_room();
  const auto render_one = [](const SceneDescription& scene) {
    return render_batches(scene, settings_for(scene, Integrator::kBdpt, 16, 4), 1).images[0].data;
  };
  const auto expected = render_one(s.scene);
  for (const int k : {-40, 3, 40}) {
    EXPECT_EQ(expected, render_one(scaled_scene(s.scene, k))) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Volumes, ::testing::Values(Integrator::kPt, Integrator::kLt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, VolumeStrategySet, ::testing::Range(1u, kAllStrategies + 1), set_name);

}  // namespace
}  // namespace lightmill::test
