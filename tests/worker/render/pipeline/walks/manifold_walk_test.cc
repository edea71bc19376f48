// Walks find the ways by which lights shine off mirrors and through glass, and what comes by them.
#include "worker/render/pipeline/walks/manifold_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/bsdf/specular_lobes.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

SpecularEvents events_of(std::initializer_list<bool> from_the_light) {
  SpecularEvents events;
  for (const bool passes : from_the_light) events.prepend(passes);
  return events;
}

TEST(SpecularEvents, AreInTheOrderOfCameraPaths) {
  const SpecularEvents events = events_of({true, false, false});  // off two mirrors behind glass
  EXPECT_EQ(events.count(), 3);
  EXPECT_EQ(SpecularEvents::count_of(events.code()), 3);
  EXPECT_EQ(SpecularEvents::passes(events.code(), 0), 0);
  EXPECT_EQ(SpecularEvents::passes(events.code(), 1), 0);
  EXPECT_EQ(SpecularEvents::passes(events.code(), 2), 1);
  EXPECT_NE(events, events_of({false, false, true}));
}

// A lobe that is asked for weighs what drawing it would bring.
TEST(SpecularLobes, WeighAsIfDrawn) {
  constexpr int kDraws = 4096;
  for (const BsdfKind kind : {kSmoothConductor, kSmoothDielectric, kThinDielectric, kSmoothCoatedConductor,
                              kTintedDielectric, kTintedSheet}) {
    ASSERT_TRUE(is_pure_delta(kind));
    BsdfParams<float> params;
    params.p[0] = 1.5f;
    for (const int k : {1, 2, 3}) params.p[k] = kind == kThinDielectric ? 0.0f : 0.7f;
    params.p[7] = 1.3f;
    for (const float z : {0.9f, 0.4f, -0.9f, -0.5f}) {  // under -0.5 all is reflected inside
      const Vec3<float> wo{std::sqrt(1 - z * z), 0, z};
      float drawn[2] = {0, 0};
      for (int i = 0; i < kDraws; ++i) {
        const float lobe = (static_cast<float>(i) + 0.5f) / kDraws;
        const BsdfSample<float> s =
            sample_bsdf<float>(kind, true, params, wo, lobe, 0.5f, 0.5f, Mode::kRadiance);
        if (s.valid) drawn[s.wi.z * z < 0 ? 1 : 0] += s.weight.x / kDraws;
      }
      for (const bool passes : {false, true}) {
        const BsdfSample<float> s = specular_lobe<float>(kind, true, params, wo, passes, Mode::kRadiance);
        EXPECT_EQ(s.valid, drawn[passes] > 0) << kind << " " << z << " " << passes;
        if (!s.valid) continue;
        EXPECT_EQ(s.wi.z * z < 0, passes);
        EXPECT_NEAR(s.weight.x, drawn[passes], 2e-3f) << kind << " " << z << " " << passes;
      }
    }
  }
}

/// One walk in lane 0, from p on a surface with normal `normal`.
struct Walk {
  bool found = false;
  Vec3<float> w, direction, throughput;
  float density = 0;
};
Walk walk_to(const Renderer& renderer, const Vec3<float>& p, const Vec3<float>& normal,
             const Vec3<float>& target, bool infinite, const Vec3<float>& first,
             const SpecularEvents& events) {
  const auto lanes = [](const Vec3<float>& x) { return splat3<Lane>(x.x, x.y, x.z); };
  const auto chains = std::make_unique<Wavefront>();
  RenderCounters counters;
  ChainStart start{.p = lanes(p), .ng = lanes(normal), .error = splat<Lane>(1e-7f)};
  start.events = splat_int<Lane>(events.code());
  const WalkEnd end =
      walk_manifold(renderer.context(), start, LaneMask(lane_index<Lane>() == 0), lanes(first),
                    {lanes(target), splat_mask<Lane>(infinite)}, *chains, &counters);
  EXPECT_EQ(mask_bits(end.found) & ~1u, 0u) << "nobody asked for";
  EXPECT_GT(counters.closest_hit_rays, 0u);
  const auto one = [](const Vec3<Lane>& x) { return Vec3<float>{lane(x.x, 0), lane(x.y, 0), lane(x.z, 0)}; };
  return {mask_bits(end.found) != 0, one(end.w), one(end.direction), one(end.throughput),
          lane(end.density, 0)};
}

Renderer renderer_of(const TestScene& s) {
  return {s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 8), 1};
}
Vec3<float> to(const Vec3<float>& from, const Vec3<float>& at) { return normalize(at - from); }
float distance(const Vec3<float>& a, const Vec3<float>& b) { return std::sqrt(dot(a - b, a - b)); }

// Off a plane mirror the way is that to the light's image, as far away as that.
TEST(ManifoldWalk, FindsTheImageInAMirror) {
  TestScene s;
  s.quad({-4, 2, -4}, {8, 0, 0}, {0, 0, 8}, s.conductor(0.9f, 0));
  s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f));
  const Renderer r = renderer_of(s);
  const Vec3<float> p = placed(r, {0.2, 0, 0.1}), light = placed(r, {-0.6, 1, 0.5}),
                    image = placed(r, {-0.6, 3, 0.5});
  const float d = distance(p, image);
  for (const Vec3<float>& first : {Vec3<float>{0, 1, 0}, Vec3<float>{0.1f, 0.8f, -0.2f}, to(p, image)}) {
    const Walk walk = walk_to(r, p, {0, 1, 0}, light, false, normalize(first), events_of({false}));
    ASSERT_TRUE(walk.found);
    EXPECT_LT(distance(walk.w, to(p, image)), 1e-5f);
    EXPECT_NEAR(walk.density * d * d, 1, 2e-3f);
    EXPECT_NEAR(walk.throughput.x, 0.9f, 0.05f);
    EXPECT_LT(walk.direction.y, 0);
  }
  EXPECT_FALSE(walk_to(r, p, {0, 1, 0}, light, false, {0, 1, 0}, events_of({true})).found)
      << "nothing passes";
  EXPECT_FALSE(walk_to(r, p, {0, 1, 0}, light, false, {0, 1, 0}, events_of({false, false})).found);
  EXPECT_FALSE(
      walk_to(r, p, {0, 1, 0}, placed(r, {-0.6, 3, 0.5}), false, {0, 1, 0}, events_of({false})).found)
      << "behind the mirror";

  // Far away, directions change as those to the light do.
  const Vec3<float> sun = normalize(Vec3<float>{0.3f, -0.9f, 0.2f});
  const Walk far = walk_to(r, p, {0, 1, 0}, sun, true, {0, 1, 0}, events_of({false}));
  ASSERT_TRUE(far.found);
  EXPECT_LT(distance(far.w, {sun.x, -sun.y, sun.z}), 1e-4f);
  EXPECT_NEAR(far.density, 1, 2e-3f);
}

// Through a plane: Snell's law in the plane of both points, by bisection in double.
TEST(ManifoldWalk, FindsTheWayThroughAPlane) {
  constexpr double kIndex = 1.5, kDepth = 0.7, kHeight = 1.1, kAcross = 0.8;
  TestScene s;
  s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.dielectric(kIndex, 0));
  s.quad({-1, -kDepth, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f));
  const Renderer r = renderer_of(s);
  const auto across = [&](double sine) {  // from p below to the light above, by the sine below
    const double above = kIndex * sine;
    return kDepth * sine / std::sqrt(1 - sine * sine) + kHeight * above / std::sqrt(1 - above * above);
  };
  const auto sine_to = [&](double distance) {
    double low = 0, high = 1 / kIndex - 1e-12;
    for (int i = 0; i < 100; ++i) (across((low + high) / 2) < distance ? low : high) = (low + high) / 2;
    return low;
  };
  const double sine = sine_to(kAcross), above = kIndex * sine, cosine = std::sqrt(1 - sine * sine);
  const Vec3<float> p = placed(r, {0, -kDepth, 0}), light = placed(r, {kAcross, kHeight, 0});
  const Walk walk = walk_to(r, p, {0, 1, 0}, light, false, {0, 1, 0}, events_of({true}));
  ASSERT_TRUE(walk.found);
  EXPECT_NEAR(walk.w.x, sine, 2e-5);
  EXPECT_NEAR(walk.w.y, cosine, 2e-5);
  EXPECT_NEAR(walk.w.z, 0, 2e-5);
  EXPECT_NEAR(walk.direction.x, above, 1e-3);
  // Solid angle below per area across the ray above: in the plane of both d(angle) / (cos d(across)), and at
  // right angles to it the sine over the distance across.
  const double e = 1e-6, in_plane = (std::asin(sine_to(kAcross + e)) - std::asin(sine_to(kAcross - e))) /
                                    (2 * e) / std::sqrt(1 - above * above);
  const double scale = double{distance(p, light)} / std::hypot(kAcross, kDepth + kHeight);
  EXPECT_NEAR(double{walk.density} * scale * scale, in_plane * sine / kAcross,
              5e-3 * in_plane * sine / kAcross);
  // What passes is spread over a larger solid angle above.
  float unused;
  const float reflected =
      fresnel_dielectric(static_cast<float>(cosine), 1 / static_cast<float>(kIndex), &unused);
  EXPECT_NEAR(double{walk.throughput.x}, double{1 - reflected} * kIndex * kIndex, 1e-3);
}

}  // namespace
}  // namespace lightmill::test
