// pt, bdpt and lt agree, per channel and 8x8 block, within their confidence intervals on real scenes.
//
// Every comparison is of 16 independent batches a side; Welch's t per block and channel, family-wise alpha =
// 1e-4 (Sidak). Two things keep that honest where distributions have heavy tails:
//   * A block whose relative standard error in either image is above `noisy` is excluded, and not more than a
//     stated fraction of the blocks may be.
//   * Path tracing all but never finds a caustic of a tiny lamp, so its batches seem quiet and are too dark:
//     no statistic of the sample shows what was not sampled. For the two caustic scenes, equality is tested
//     with the lamp enlarged (same flux), where every integrator samples every path; with the lamp as it is,
//     only that pt is not *brighter* than bdpt, and that lt, which finds the caustic, equals bdpt.
// lt sees no surface whose reflection towards the camera is a delta, and has heavy tails where it is nearly
// one: blocks that show a delta lobe or a roughness below 0.15 are left out for it. (The coffee maker's
// picture is all coated: nothing of it is left.) Every comparison must also fail when one image is scaled by
// a stated factor.
#include "tests/support/agreement.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/scene/load.h"
#include "tests/support/test_scene.h"
#include "worker/render/accel/accel.h"
#include "worker/render/camera/perspective.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill::test {
namespace {

constexpr int kAgreementBatches = 16;

struct SceneCase {
  const char* name;
  const char* file;  // below the source folder
  int width, height;
  int64_t pt_spp, bdpt_spp, lt_spp;
  double noisy;            // largest relative standard error of a block that is judged
  double excluded;         // largest fraction of excluded blocks, pt against bdpt
  double notices;          // scaling bdpt by this factor makes its comparison with pt fail; 0: not compared
  double lt_excluded = 1;  // the same against lt
  double lt_notices = 0;   // 0: lt is not compared
  float enlarge = 1;       // of the lamps' sides, at the same flux
  bool pt_misses = false;  // pt cannot sample all light: it must only not be brighter
};

SceneDescription load(const std::string& path) {
  return load_scene_file(path, {}, [](const Problem&) {});
}

/// Scales the sides of every emitting mesh about its centre, and its radiance so that the flux stays.
void enlarge_lamps(SceneDescription* scene, float factor) {
  for (ShapeDescription& shape : scene->shapes) {
    const auto* mesh = std::get_if<MeshShape>(&shape.kind);
    if (shape.area_light < 0 || !mesh) continue;
    TriangleMesh copy = *mesh->mesh;
    Vec3f c;
    const auto n = static_cast<float>(copy.positions.size());
    for (const Vec3f& p : copy.positions) c = {c.x + p.x / n, c.y + p.y / n, c.z + p.z / n};
    for (Vec3f& p : copy.positions) {
      p = {c.x + (p.x - c.x) * factor, c.y + (p.y - c.y) * factor, c.z + (p.z - c.z) * factor};
    }
    shape.kind = MeshShape{std::make_shared<TriangleMesh>(std::move(copy))};
    Rgb& l = scene->area_lights[static_cast<size_t>(shape.area_light)].radiance;
    l = {l.r / (factor * factor), l.g / (factor * factor), l.b / (factor * factor)};
  }
}

/// Which pixels show, at any of 4x4 points, a surface with a (nearly) delta lobe; a margin of the filter's
/// reach is added when a rectangle is asked.
class DeltaMask {
 public:
  DeltaMask(const SceneDescription& description, const FilmGrid& grid)
      : width_(grid.width),
        height_(grid.height),
        margin_(static_cast<int>(std::ceil(description.filter.xradius))) {
    const RenderScene scene = build_scene(description);
    const Accel accel(scene, 1);
    const PerspectiveCamera camera(description.camera, width_, height_);
    delta_.resize(static_cast<size_t>(width_) * static_cast<size_t>(height_));
    for (int y = 0; y < 4 * height_; ++y) {
      for (int x = 0; x < 4 * width_; ++x) {
        float cosine;
        const Vec3<float> o{}, d = camera.direction((static_cast<float>(x) + 0.5f) / 4,
                                                    (static_cast<float>(y) + 0.5f) / 4, &cosine);
        const int32_t id = 0;
        TracedRay ray{{o.x, o.y, o.z}, {d.x, d.y, d.z}, -1, -1};
        accel.closest_hits(&ray, &id, 1);
        const int32_t prim = ray.prim;
        if (prim < 0) continue;
        const int32_t kind =
            scene.material_kind[static_cast<size_t>(scene.primitive_material[static_cast<size_t>(prim)])];
        const float alpha =
            scene.material_params[static_cast<size_t>(scene.primitive_material[static_cast<size_t>(prim)]) *
                                      kBsdfParams +
                                  6];
        if (kind != kDiffuse && (is_pure_delta(kind) || kind == kSmoothCoated || alpha < 0.15f))
          delta_[static_cast<size_t>((y / 4) * width_ + x / 4)] = true;
      }
    }
    mark_tiny_lamps(scene, camera);
  }
  bool free(const PixelRect& r) const {
    for (int y = std::max(0, r.y0 - margin_); y < std::min(height_, r.y1 + margin_); ++y) {
      for (int x = std::max(0, r.x0 - margin_); x < std::min(width_, r.x1 + margin_); ++x) {
        if (delta_[static_cast<size_t>(y * width_ + x)]) return false;
      }
    }
    return true;
  }

 private:
  /// A visible lamp smaller than a pixel: camera paths (s = 0) meet it too rarely for their
  /// batches to show it.
  void mark_tiny_lamps(const RenderScene& scene, const PerspectiveCamera& camera) {
    for (int32_t t = 0; t < scene.triangle_count(); ++t) {
      if (scene.primitive_light[static_cast<size_t>(t)] < 0) continue;
      float x[3], y[3];
      bool seen = true;
      for (size_t k = 0; k < 3; ++k) {
        const float* p =
            &scene.positions[3 * static_cast<size_t>(scene.indices[3 * static_cast<size_t>(t) + k])];
        float cosine;
        camera.project(normalize(Vec3<float>{p[0], p[1], p[2]}), &x[k], &y[k], &cosine);
        seen = seen && cosine > 0;
      }
      if (!seen || std::max({x[0], x[1], x[2]}) - std::min({x[0], x[1], x[2]}) > 1) continue;
      const int px = static_cast<int>(x[0]), py = static_cast<int>(y[0]);
      if (px >= 0 && py >= 0 && px < width_ && py < height_)
        delta_[static_cast<size_t>(py * width_ + px)] = true;
    }
  }

  int width_, height_, margin_;
  std::vector<bool> delta_;
};

class AgreementOf : public ::testing::TestWithParam<SceneCase> {};

TEST_P(AgreementOf, Estimators) {
  const SceneCase& c = GetParam();
  const std::string path = std::string(LIGHTMILL_SOURCE_DIR) + "/" + c.file;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
  SceneDescription scene = load(path);
  if (c.enlarge != 1) enlarge_lamps(&scene, c.enlarge);
  scene.film.width = c.width;
  scene.film.height = c.height;
  scene.film.crop.reset();
  const auto render = [&](Integrator integrator, int64_t spp) {
    const Batches b = render_batches(scene, settings_for(scene, integrator, spp, scene.sampling.max_depth, 7),
                                     kAgreementBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u) << name_of(integrator);
    return b;
  };
  const Batches bdpt = render(Integrator::kBdpt, c.bdpt_spp);
  const Batches pt = c.notices == 0 ? Batches() : render(Integrator::kPt, c.pt_spp);
  AgreementTest test{.max_relative_error = c.noisy, .max_excluded = c.excluded};
  if (c.notices == 0) {
    // Only lt is compared.
  } else if (c.pt_misses) {
    test.one_sided = true;
    EXPECT_TRUE(images_agree(pt, bdpt, test)) << "pt is brighter than bdpt";
    EXPECT_FALSE(images_agree(pt, scaled(bdpt, static_cast<float>(1 / c.notices)), test))
        << "the test notices nothing";
  } else {
    EXPECT_TRUE(images_agree(pt, bdpt, test)) << "pt against bdpt";
    EXPECT_FALSE(images_agree(pt, scaled(bdpt, static_cast<float>(c.notices)), test))
        << "the test notices nothing";
    EXPECT_TRUE(means_agree(pt.mean(), bdpt.mean(), {.resolution = 0.15})) << "pt against bdpt, whole image";
  }
  if (c.lt_notices == 0) return;
  const Batches lt = render(Integrator::kLt, c.lt_spp);
  const DeltaMask mask(scene, settings_for(scene, Integrator::kLt, 1, 1).grid);
  AgreementTest lt_test{.max_relative_error = c.noisy, .max_excluded = c.lt_excluded};
  lt_test.include = [&](const PixelRect& r) { return mask.free(r); };
  EXPECT_TRUE(images_agree(bdpt, lt, lt_test)) << "bdpt against lt";
  EXPECT_FALSE(images_agree(bdpt, scaled(lt, static_cast<float>(c.lt_notices)), lt_test))
      << "the test notices nothing";
  if (c.pt_misses || c.notices == 0) return;
  EXPECT_TRUE(images_agree(pt, lt, lt_test)) << "pt against lt";
}

const SceneCase kScenes[] = {
    {"cornell_box", "../shared/scenes/cornell-box/scene-v4.pbrt", 64, 64, 512, 256, 512, 0.1, 0.02, 1.05,
     0.02, 1.06},
    {"veach_mis", "../shared/scenes/veach-mis/scene-v4.pbrt", 64, 40, 512, 256, 1024, 0.1, 0.1, 1.05, 0.15,
     1.1},
    {"veach_bidir", "../shared/scenes/veach-bidir/scene-v4.pbrt", 64, 40, 2048, 256, 512, 0.15, 0.1, 1.15,
     0.6, 1.2},
    {"coffee", "../shared/scenes/coffee/scene-v4.pbrt", 48, 64, 512, 256, 0, 0.1, 0.05, 1.06},
    {"veach_ajar", "../shared/scenes/veach-ajar/scene-v4.pbrt", 64, 40, 1024, 256, 512, 0.15, 0.05, 1.2, 0.3,
     1.3},
    {"water_caustic", "../shared/scenes/water-caustic/scene-v4.pbrt", 48, 48, 0, 256, 1024, 0.2, 0, 0, 0.3,
     1.2},
    {"water_caustic_large_lamp", "../shared/scenes/water-caustic/scene-v4.pbrt", 24, 24, 4096, 1024, 0, 0.2,
     0.2, 1.4, 1, 0, 160},
    {"cornell_spheres", "scenes/cornell-spheres.pbrt", 64, 64, 512, 256, 512, 0.1, 0.02, 1.07, 0.1, 1.1},
    {"ring_caustic", "scenes/ring-caustic.pbrt", 64, 64, 512, 256, 1024, 0.1, 0.3, 1.05, 0.1, 1.1, 1, true},
    {"ring_caustic_large_lamp", "scenes/ring-caustic.pbrt", 64, 64, 1024, 512, 1024, 0.1, 0.1, 1.05, 0.2, 1.1,
     20},
};

INSTANTIATE_TEST_SUITE_P(Scenes, AgreementOf, ::testing::ValuesIn(kScenes),
                         [](const auto& info) { return std::string(info.param.name); });

// Colour bleeding in a room as a number: the white floor beside the red wall is redder than beside the green
// one, and all three integrators give the same ratio of red to green.
TEST(ColourBleeding, OfTheRoomsFloor) {
  TestScene s = cornell_room();
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 80).film(32, 32);
  const auto ratio = [](const PixelRect& r) {
    return [r](const Image& image) {
      double red = 0, green = 0;
      for (int y = r.y0; y < r.y1; ++y) {
        for (int x = r.x0; x < r.x1; ++x) red += image.pixel(x, y)[0], green += image.pixel(x, y)[1];
      }
      return red / green;
    };
  };
  std::vector<Estimate> left, right;
  for (const Integrator i : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const Batches b = render_batches(s.scene, settings_for(s.scene, i, 1024, 6), kAgreementBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    left.push_back(b.of(ratio({6, 14, 10, 20})));
    right.push_back(b.of(ratio({22, 14, 26, 20})));
  }
  const double lamp = 8.0 / 7;  // red to green of the lamp itself
  for (size_t i = 0; i < left.size(); ++i) {
    EXPECT_GT(left[i].mean, 1.05 * lamp) << i;
    EXPECT_LT(right[i].mean, 0.98 * lamp) << i;
    EXPECT_TRUE(means_agree(left[0], left[i], {.resolution = 0.03})) << i;
    EXPECT_TRUE(means_agree(right[0], right[i], {.resolution = 0.03})) << i;
  }
}

}  // namespace
}  // namespace lightmill::test
