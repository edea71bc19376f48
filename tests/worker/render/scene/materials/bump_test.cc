// Normal maps and bump maps against normals known in closed form; tangents and coordinates of spheres.
#include "worker/render/scene/materials/bump.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/materials/lobe_axes.h"

namespace lightmill::test {
namespace {

int constant(TestScene* s, const Rgb& c) {
  TextureDescription t;
  t.kind = ConstantTexture{c};
  s->scene.textures.push_back(t);
  return static_cast<int>(s->scene.textures.size()) - 1;
}

/// A quad of side 2 at z = 2 that faces the origin, u along +x, v along +y.
void add_quad(TestScene* s, int material, bool inward = false) {
  s->quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, material, {.inward = inward});
  TriangleMesh mesh = *std::get<MeshShape>(s->scene.shapes.back().kind).mesh;
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  s->scene.shapes.back().kind = MeshShape{std::make_shared<TriangleMesh>(mesh)};
  s->camera({0, 0, 0}, {0, 0, 1}, 60);
}

Vec3<float> normal_at(const RenderScene& scene, int32_t prim, const Vec3<float>& d) {
  const Surface<float> hit = surface_at<float>(scene, prim, {}, normalize(d));
  return bumped_normal(scene, scene.materials[0], hit);
}

TEST(Bump, NormalMapIsInTheFrameOfTheTangentAndTheNormal) {
  // The quad's normal is +z (u x v); reversed it is -z, and y = z x x turns with it.
  for (const bool reversed : {false, true}) {
    TestScene s;
    const int m = s.diffuse(0.5f);
    s.scene.materials[0].normal_map = constant(&s, {0.5f + 0.3f, 0.5f + 0.2f, 0.5f + 0.4f});
    add_quad(&s, m, reversed);
    const RenderScene scene = build_scene(s.scene);
    const Vec3<float> n = normal_at(scene, 0, {0.2f, 0.1f, 2});
    const float sign = reversed ? -1.0f : 1.0f, length = std::sqrt(0.09f + 0.04f + 0.16f);
    EXPECT_NEAR(n.x, 0.3f / length, 1e-5f);
    EXPECT_NEAR(n.y, sign * 0.2f / length, 1e-5f);
    EXPECT_NEAR(n.z, sign * 0.4f / length, 1e-5f);
  }
}

TEST(Bump, AFlatMapChangesNothingAndANormalBelowTheSurfaceIsTurnedUp) {
  TestScene s;
  const int m = s.diffuse(0.5f);
  s.scene.materials[0].normal_map = constant(&s, {0.5f, 0.5f, 1});
  add_quad(&s, m);
  EXPECT_NEAR(normal_at(build_scene(s.scene), 0, {0.2f, 0.1f, 2}).z, 1, 1e-6f);
  s.scene.materials[0].normal_map = constant(&s, {0.5f, 0.9f, 0.1f});
  EXPECT_GT(normal_at(build_scene(s.scene), 0, {0.2f, 0.1f, 2}).z, 0);
  s.scene.materials[0].normal_map = constant(&s, {0.5f, 0.5f, 0.5f});  // no direction
  EXPECT_NEAR(normal_at(build_scene(s.scene), 0, {0.2f, 0.1f, 2}).z, 1, 1e-6f);
}

/// A float texture that is 0 where u < 1/2 and `height` elsewhere: mixed by a checkerboard of one step.
int step_texture(TestScene* s, float height) {
  TextureDescription t;
  t.is_spectrum = false;
  t.kind = CheckerboardTexture{{{0, 0, 0}, -1}, {{height, height, height}, -1}, {2, 0, 0, 0.5f}};
  s->scene.textures.push_back(t);
  return static_cast<int>(s->scene.textures.size()) - 1;
}

// Heights are in scene units and positions in normalised space: the slope is theirs whatever the scale.
TEST(Bump, SlopesDoNotDependOnTheSceneScale) {
  for (const double far : {2.0, 50.0, 3000.0}) {
    TestScene s;
    const int m = s.diffuse(0.5f);
    constexpr float kHeight = 0.0004f;
    s.scene.materials[0].displacement = step_texture(&s, kHeight);
    add_quad(&s, m);
    s.point_light({0, 0, far}, {1, 1, 1});  // part of the extent
    const RenderScene scene = build_scene(s.scene);
    // Just before the step, which the forward difference sees whole: dh/dx = height / (step of u * 2).
    const Vec3<float> n = normal_at(scene, 0, {-0.0002f, -0.1f, 2});
    EXPECT_NEAR(n.x / n.z, -kHeight / (2 * kBumpStep), 1e-3f) << far;
    EXPECT_NEAR(n.y, 0, 1e-6f);
    EXPECT_NEAR(normal_at(scene, 0, {0.3f, -0.1f, 2}).z, 1, 1e-6f);  // flat beyond it
  }
}

/// A float texture of 0 at u = 0 and `height` at u = 1.
int ramp_texture(TestScene* s, float height) {
  TextureDescription t;
  t.is_spectrum = false;
  const Rgb top{height, height, height};
  t.kind = BilerpTexture{{}, {}, top, top, {}};
  s->scene.textures.push_back(t);
  return static_cast<int>(s->scene.textures.size()) - 1;
}

// Blender's bumps: as much of the tilt as the strength says, on scenes of any size, over a normal map, too.
TEST(Bump, ByPixelARampTiltsByItsSlopeAndStrength) {
  for (const double far : {2.0, 3000.0}) {
    for (const float strength : {0.0f, 0.5f, 1.0f, 2.0f}) {
      for (const bool mapped : {false, true}) {
        TestScene s;
        const int m = s.diffuse(0.5f);
        constexpr float kHeight = 0.6f, kSlope = kHeight / 2;  // the quad is 2 wide
        MaterialDescription& material = s.scene.materials[0];
        material.displacement = ramp_texture(&s, kHeight);
        material.bump_by_pixel = true;
        material.bump_strength.value = strength;
        if (mapped) material.normal_map = constant(&s, {0.5f, 0.5f, 1});
        add_quad(&s, m);
        s.point_light({0, 0, far}, {1, 1, 1});  // part of the extent
        const Vec3<float> n = normal_at(build_scene(s.scene), 0, {0.05f, -0.1f, 2});
        const float length = std::sqrt(1 + kSlope * kSlope);
        const Vec3<float> kept =
            normalize(Vec3<float>{-kSlope / length * strength, 0, 1 - strength + strength / length});
        EXPECT_NEAR(n.x, kept.x, 1e-3f) << far << " " << strength;
        EXPECT_NEAR(n.y, 0, 1e-3f);
        EXPECT_NEAR(n.z, kept.z, 1e-3f);
      }
    }
  }
}

TEST(Bump, ByPixelAStepIsAsSteepAsAPixelIsWide) {
  for (const int size : {50, 400}) {
    TestScene s;
    const int m = s.diffuse(0.5f);
    constexpr float kHeight = 0.002f;
    s.scene.materials[0].displacement = step_texture(&s, kHeight);
    s.scene.materials[0].bump_by_pixel = true;
    add_quad(&s, m);
    s.film(size, size);
    const RenderScene scene = build_scene(s.scene);
    const float pixel = 2 * 2 * std::tan(static_cast<float>(M_PI) / 6) / static_cast<float>(size);
    const auto slope = [&](float x) {
      const Vec3<float> n = normal_at(scene, 0, {x, -0.2f, 2});  // within the first triangle
      return -n.x / n.z;
    };
    EXPECT_NEAR(slope(-0.5f * pixel), kHeight / pixel, 0.01f * kHeight / pixel) << size;
    EXPECT_NEAR(slope(-1.5f * pixel), 0, 1e-6f);
    EXPECT_NEAR(slope(0.5f * pixel), 0, 1e-6f);
  }
}

// A normal whose mirror image of the viewer lies below the surface is turned until it is just above; others
// stay.
TEST(Bump, NormalsTurnToTheViewerAsFarAsTheMirrorImageNeeds) {
  Random random(11);
  int turned = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto upwards = [&](double low) {
      const double z = random.between(low, 1), phi = random.between(0, 2 * M_PI), r = std::sqrt(1 - z * z);
      return Vec3<float>{static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)),
                         static_cast<float>(z)};
    };
    const Vec3<float> ng{0, 0, 1}, ns = upwards(0.02), wo = upwards(0.02);
    const auto height = [&](const Vec3<float>& n) { return 2 * dot(wo, n) * n.z - wo.z; };
    const float least = std::min(0.9f * wo.z, 0.01f);
    const Vec3<float> n = reflecting_normal<float>(ns, ng, wo);
    EXPECT_NEAR(dot(n, n), 1, 1e-5f);
    if (height(ns) >= least) {
      EXPECT_EQ(n.x, ns.x);
      continue;
    }
    ++turned;
    EXPECT_NEAR(height(n), least, 1e-4f);
    EXPECT_GT(n.z, ns.z);
    EXPECT_NEAR(n.x * ns.y, n.y * ns.x, 1e-5f);  // in the plane of both normals
    EXPECT_GE(n.x * ns.x + n.y * ns.y, 0);
  }
  EXPECT_GT(turned, 300);
}

TEST(Bump, LobesLieAlongTheTangentOfTheMaterial) {
  for (const bool given : {false, true}) {
    TestScene s;
    s.diffuse(0.5f);
    MaterialDescription& material = s.scene.materials[0];
    ClosureMaterial glossy;
    glossy.closure = ClosureKind::kGlossy;
    glossy.roughness.value = 0.5f;
    glossy.anisotropy.value = 0.5f;
    material.kind = glossy;
    if (given) material.tangent = constant(&s, {0, 3, 0.2f});
    add_quad(&s, 0);
    const RenderScene scene = build_scene(s.scene);
    const Surface<float> hit = surface_at<float>(scene, 0, {}, normalize(Vec3<float>{0.2f, 0.1f, 2}));
    BsdfParams<float> params;
    const int32_t kind = bsdf_at<float>(scene, 0, true, hit, &params);
    ASSERT_TRUE(anisotropic<float>(kind));
    orient_lobes<float>(scene, 0, true, hit, hit.ns, kind, &params);
    // In turns from the first axis of the frame, which is +x.
    EXPECT_NEAR(params.p[9], given ? (hit.ns.z > 0 ? 0.25f : 0.75f) : 0, 1e-5f);
  }
}

TEST(Bump, SpheresHaveTheCoordinatesAndDerivativesOfTheirOwnSpace) {
  TestScene s;
  const int m = s.diffuse(0.5f);
  s.scene.materials[0].normal_map = constant(&s, {0.5f, 0.5f, 1});
  s.sphere({0, 0, 4}, 1.5, m).camera({0, 0, 0}, {0, 0, 1}, 60);
  // Its own z is the world's y, its x the world's z: a turn, radius times 2 by the transform.
  auto& t = s.scene.shapes.back().object_to_world.m;
  t = {{{0, 2, 0, 0}, {0, 0, 2, 0}, {2, 0, 0, 8}, {0, 0, 0, 1}}};
  const RenderScene scene = build_scene(s.scene);
  Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3<float> d = normalize(Vec3<float>{static_cast<float>(random.between(-0.3, 0.3)),
                                                static_cast<float>(random.between(-0.3, 0.3)), 1});
    const Surface<float> a = surface_at<float>(scene, 0, {}, d);
    // Object-space point from the world's offset.
    const Vec3d n{a.ng.z, a.ng.x, a.ng.y};
    double phi = std::atan2(n.y, n.x);
    if (phi < 0) phi += 2 * M_PI;
    EXPECT_NEAR(a.u, phi / (2 * M_PI), 2e-6);
    EXPECT_NEAR(a.v, 1 - std::acos(n.z) / M_PI, 2e-6);
    // A small turn of the ray moves the point by dp/du du + dp/dv dv, but for the second order.
    const Vec3<float> moved = normalize(d + Vec3<float>{0.001f, 0.0007f, 0});
    const Surface<float> b = surface_at<float>(scene, 0, {}, moved);
    if (std::fabs(b.u - a.u) > 0.5f) continue;  // across the seam
    const Vec3<float> expected = a.dpdu * (b.u - a.u) + a.dpdv * (b.v - a.v), got = b.p - a.p;
    const Vec3<float> off = expected - got;
    EXPECT_LT(dot(off, off), 0.01f * dot(got, got));
  }
}

TEST(Bump, LanesHaveTheBitsOfScalars) {
  TestScene s;
  const int m = s.diffuse(0.5f);
  s.scene.materials[0].normal_map = constant(&s, {0.7f, 0.4f, 0.8f});
  const int plain = s.diffuse(0.2f);
  s.box({-1, -1, -1}, {1, 1, 1}, m, {.inward = true})
      .sphere({0, 0, 0.5}, 0.2, m)
      .sphere({0.4, 0, 0.5}, 0.2, plain)
      .camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  Random random(3);
  for (int round = 0; round < 200; ++round) {
    Vec3<Float8> d;
    Int8 prim{};
    Vec3<float> ds[8];
    for (int l = 0; l < 8; ++l) {
      ds[l] = normalize(Vec3<float>{static_cast<float>(random.between(-1, 1)),
                                    static_cast<float>(random.between(-1, 1)), 1});
      d.x[l] = ds[l].x, d.y[l] = ds[l].y, d.z[l] = ds[l].z;
      prim[l] = static_cast<int32_t>(random.bits() % 14);
    }
    const Surface<Float8> h = surface_at<Float8>(scene, prim, {}, d);
    const Int8 material = gather(scene.primitive_material.data(), prim);
    const Vec3<Float8> n = bumped_normals<Float8>(scene, material, splat_mask<Float8>(true), h);
    for (int l = 0; l < 8; ++l) {
      const Surface<float> g = surface_at<float>(scene, prim[l], {}, ds[l]);
      const Vec3<float> one = bumped_normals<float>(scene, material[l], true, g);
      ASSERT_EQ(float_bits(n.x[l]), float_bits(one.x));
      ASSERT_EQ(float_bits(n.y[l]), float_bits(one.y));
      ASSERT_EQ(float_bits(n.z[l]), float_bits(one.z));
      ASSERT_EQ(float_bits(h.u[l]), float_bits(g.u));
      ASSERT_EQ(float_bits(h.dpdv.x[l]), float_bits(g.dpdv.x));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
