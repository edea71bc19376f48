// What the scene plan leaves out does nothing: switched on, the image has the same bits.
#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/job/features.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

constexpr Features kBitwise = kAllFeatures & ~kAllStrategies;

TestScene diffuse_room() { return cornell_room().film(40, 24); }

/// Metal, glass, a coat, a sphere light and the sky: every feature that is not under test.
TestScene mixed_room() {
  TestScene s = cornell_room();
  s.sphere({0.3, -0.7, 0.2}, 0.25, s.conductor(0.9f, 0.2f));
  s.sphere({-0.4, -0.7, 0.1}, 0.25, s.dielectric(1.5f, 0));
  s.box({-0.1, -0.99, 0.5}, {0.2, -0.5, 0.8}, s.coated({0.5f, 0.3f, 0.2f}, 1.5f, 0.1f));
  s.environment({0.1f, 0.2f, 0.3f});
  return s.film(40, 24);
}

Partial render(const TestScene& s, Integrator integrator, Features overrides) {
  RenderSettings settings = settings_for(s.scene, integrator, 4, 5);
  settings.overrides = overrides;
  return render_partial(s.scene, settings, 2);
}

bool same_layers(const Partial& a, const Partial& b) { return a.camera == b.camera && a.splats == b.splats; }

TEST(PlanOverride, WhatIsLeftOutWouldNotChangeABit) {
  for (const TestScene& s : {diffuse_room(), mixed_room()}) {
    for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt}) {
      const Partial plain = render(s, integrator, 0);
      for (Features bit = 1; bit <= kAllFeatures; bit <<= 1) {
        if (!(bit & kBitwise)) continue;
        EXPECT_TRUE(same_layers(plain, render(s, integrator, bit)))
            << feature_names(bit) << " " << name_of(integrator);
      }
      EXPECT_TRUE(same_layers(plain, render(s, integrator, kBitwise))) << name_of(integrator);
    }
  }
}

TEST(PlanOverride, TheTestWouldNoticeAnotherImage) {
  EXPECT_FALSE(same_layers(render(diffuse_room(), Integrator::kPt, 0),
                           render(diffuse_room(), Integrator::kPt, kVertexConnections)));
}

TEST(PlanOverride, SwitchesItsItemOn) {
  const TestScene s = diffuse_room();
  RenderSettings settings = settings_for(s.scene, Integrator::kPt, 4, 5);
  const Renderer plain(s.scene, settings, 1);
  Features left_out = 0;
  for (const PlanItem& item : plain.plan().items) {
    if (!item.needed) left_out |= item.feature_bit;
  }
  EXPECT_EQ(left_out | kEmissionHits | kNextEvent, kAllFeatures) << feature_names(left_out);
  settings.overrides = kAllFeatures;
  const Renderer all(s.scene, settings, 1);
  for (const PlanItem& item : all.plan().items) {
    if (!item.feature_bit) continue;
    EXPECT_TRUE(item.needed) << item.feature;
    EXPECT_NE(item.reason.find("--plan-override"), std::string::npos) << item.feature << ": " << item.reason;
  }
}

TEST(Features, AreReadByName) {
  EXPECT_EQ(features_named(""), 0u);
  EXPECT_EQ(features_named("textures,light-tracing"), kTextures | kLightTracing);
  for (Features bit = 1; bit <= kAllFeatures; bit <<= 1) EXPECT_EQ(features_named(feature_names(bit)), bit);
  EXPECT_EQ(features_named(feature_names(kAllFeatures)), kAllFeatures);
  for (const char* bad : {"texture", "textures,,light-tracing", "textures;light-tracing", " light-tracing"})
    EXPECT_THROW(features_named(bad), Error) << bad;
  try {
    features_named("fog");
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("there are hit, next-event, light-tracing"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace lightmill::test
