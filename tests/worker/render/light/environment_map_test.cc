// The equal-area mapping and environment images: round trips, equal areas, chi^2 of the sampling.
#include "worker/render/light/environment_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

/// 8x8 texels of very different brightness, some black.
Image sky() {
  Image image(8, 8);
  Random random(3);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const float v = (x + 3 * y) % 5 == 0 ? 0 : 0.1f + random.uniform() * random.uniform() * 20;
      float* p = image.pixel(x, y);
      p[0] = v, p[1] = 0.5f * v, p[2] = 0.25f * v;
    }
  }
  return image;
}

TEST(EqualArea, RoundTripsOverTheWholeSphere) {
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const float s = random.uniform(), t = random.uniform();
    const Vec3<float> w = equal_area_square_to_sphere(s, t);
    ASSERT_NEAR(dot(w, w), 1, 2e-6);
    float s2, t2;
    equal_area_sphere_to_square(w, &s2, &t2);
    // At the square's edges the sphere's lower half meets itself, and near the poles of the map the inverse
    // is a root: compare directions there.
    const Vec3<float> w2 = equal_area_square_to_sphere(s2, t2);
    ASSERT_GT(dot(w, w2), 1 - 1e-6f) << s << " " << t;
  }
}

TEST(EqualArea, UniformPointsAreUniformDirections) {
  Random random(2);
  constexpr int kSamples = 200000, kZ = 16, kPhi = 16;
  std::vector<double> observed(kZ * kPhi), expected(kZ * kPhi, double{kSamples} / (kZ * kPhi));
  for (int i = 0; i < kSamples; ++i) {
    const Vec3<float> w = equal_area_square_to_sphere(random.uniform(), random.uniform());
    const int z = std::min(kZ - 1, static_cast<int>((w.z + 1) * 0.5f * kZ));
    const int phi = std::min(kPhi - 1, static_cast<int>((std::atan2(w.y, w.x) / (2 * M_PI) + 0.5) * kPhi));
    ++observed[static_cast<size_t>(z * kPhi + phi)];
  }
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

TEST(EqualArea, LanesGiveTheSameBits) {
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    Float8 s, t;
    for (int l = 0; l < 8; ++l) s[l] = random.uniform(), t[l] = random.uniform();
    const Vec3<Float8> w = equal_area_square_to_sphere(s, t);
    Float8 u, v;
    equal_area_sphere_to_square(w, &u, &v);
    for (int l = 0; l < 8; ++l) {
      const Vec3<float> one = equal_area_square_to_sphere(s[l], t[l]);
      ASSERT_EQ(one.x, w.x[l]);
      ASSERT_EQ(one.z, w.z[l]);
      float a, b;
      equal_area_sphere_to_square(one, &a, &b);
      ASSERT_EQ(a, u[l]);
      ASSERT_EQ(b, v[l]);
    }
  }
}

TEST(EnvironmentMap, SamplesTexelsInProportionToTheirLight) {
  const TemporaryFolder folder;
  const Image image = sky();
  write_image(image, folder.file("sky.exr"));
  Transform turn;  // a quarter turn about x
  turn.m = {{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}};
  const EnvironmentMap map(folder.file("sky.exr"), {2, 2, 2}, turn);
  Random random(5);
  constexpr int kSamples = 100000;
  std::vector<double> observed(64), expected(64);
  double total = 0;
  for (size_t i = 0; i < 64; ++i)
    total += expected[i] = image.data[3 * i] + image.data[3 * i + 1] + image.data[3 * i + 2];
  for (double& e : expected) e *= kSamples / total;
  int elsewhere = 0;
  for (int i = 0; i < kSamples; ++i) {
    int32_t chosen;
    const Vec3<float> w = map.sample(random.uniform(), random.uniform(), random.uniform(), &chosen);
    ++observed[static_cast<size_t>(chosen)];
    if (map.texel<float>(w) != chosen) ++elsewhere;  // only by rounding at a texel's border
    ASSERT_GT(map.pdf<float>(chosen), 0);
    ASSERT_FLOAT_EQ(map.radiance<float>(chosen).x, 2 * image.data[3 * static_cast<size_t>(chosen)]);
  }
  EXPECT_LT(elsewhere, kSamples / 1000);
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

TEST(EnvironmentMap, RefusesWhatIsNoSquareOfLight) {
  const TemporaryFolder folder;
  write_image(Image(8, 4), folder.file("wide.exr"));
  write_image(Image(4, 4), folder.file("black.exr"));
  for (const char* name : {"wide.exr", "black.exr", "absent.exr"}) {
    EXPECT_THROW(EnvironmentMap(folder.file(name), {1, 1, 1}, {}), Error) << name;
  }
}

// The message names the texel, and the line of the light when the scene builder meets it.
TEST(EnvironmentMap, RefusesTexelsThatAreNoRadiance) {
  const TemporaryFolder folder;
  const std::pair<float, const char*> bad[] = {
      {NAN, "not a number"}, {INFINITY, "infinite"}, {-1.0f, "negative"}};
  for (const auto& [value, word] : bad) {
    Image image(4, 4);
    for (float& x : image.data) x = 1;
    image.data[3 * 6 + 1] = value;
    write_image(image, folder.file("sky.exr"));
    TestScene s;
    s.scene.lights.push_back({InfiniteLight{{1, 1, 1}, folder.file("sky.exr"), {}}, {"scene.pbrt", 12, 3}});
    try {
      build_scene(s.scene);
      FAIL() << word;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(message.rfind("scene.pbrt:12:3: ", 0), 0u) << message;
      EXPECT_NE(message.find("texel (2, 1)"), std::string::npos) << message;
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  }
}

// A filter's ringing is not an error: it counts as 0.
TEST(EnvironmentMap, SlightlyNegativeTexelsAreBlack) {
  const TemporaryFolder folder;
  Image image(2, 2);
  for (float& x : image.data) x = 1;
  image.data[0] = image.data[1] = image.data[2] = -0.001f;
  write_image(image, folder.file("sky.exr"));
  const EnvironmentMap map(folder.file("sky.exr"), {1, 1, 1}, {});
  EXPECT_EQ(map.rgb[0], 0.0f);
  EXPECT_EQ(map.density[0], 0.0f);
}

TEST(EnvironmentMapTest, PanoramasKeepTheirPlaceAndPower) {
  // Dark but for one bright patch each to the left of, above and right of the middle, where -x is.
  const TemporaryFolder folder;
  Image picture(128, 64);
  const auto paint = [&](int x0, int y0, int channel) {
    for (int y = y0 - 3; y < y0 + 3; ++y) {
      for (int x = x0 - 3; x < x0 + 3; ++x) picture.pixel(x, y)[channel] = 1;
    }
  };
  paint(64, 32, 0);  // the middle
  paint(96, 32, 1);  // a quarter turn to the right
  paint(64, 16, 2);  // 45 degrees up
  write_image(picture, folder.file("sky.exr"), {});
  const EnvironmentMap map(folder.file("sky.exr"), {1, 1, 1}, {}, true);
  const auto seen = [&](float x, float y, float z) {
    return map.radiance<float>(map.texel<float>(normalize(Vec3<float>{x, y, z})));
  };
  EXPECT_NEAR(seen(-1, 0, 0).x, 1, 1e-5);
  EXPECT_NEAR(seen(0, 0, -1).y, 1, 1e-5);
  EXPECT_NEAR(seen(-1, 1, 0).z, 1, 1e-5);
  EXPECT_EQ(seen(1, 0, 0).x, 0);
  // The mean over the sphere, by the picture's own rows.
  double sum = 0, weight = 0;
  for (int y = 0; y < 64; ++y) {
    const double w = std::cos(y * M_PI / 64) - std::cos((y + 1) * M_PI / 64);
    for (int x = 0; x < 128; ++x) {
      const float* p = picture.pixel(x, y);
      sum += w * (p[0] + p[1] + p[2]) / 3;
      weight += w;
    }
  }
  EXPECT_NEAR(map.mean_radiance, sum / weight, 0.01 * sum / weight);
}

}  // namespace
}  // namespace lightmill::test
