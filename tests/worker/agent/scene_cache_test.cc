#include "worker/agent/scene_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "tests/worker/agent/fake_farm.h"
#include "tests/worker/agent/temporary_folder.h"

namespace lightmill::agent {
namespace {

using testing::FakeFarm;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

constexpr char kScene[] = R"(Camera "perspective"
WorldBegin
LightSource "point" "rgb I" [1 1 1]
Include "ball.pbrt"
)";

class SceneCacheTest : public ::testing::Test {
 protected:
  SceneCacheTest() : cache_(farm_, options(1 << 20)) { settings_.grid = {32, 32, {0, 0, 32, 32}}; }
  SceneCacheOptions options(uint64_t scene_bytes) const {
    return {(folder_.path / "blobs").string(), 1 << 20, scene_bytes, 1};
  }
  /// A scene of its own, of as much memory as the others of this name.
  std::string ball(int number) {
    return add("Translate 0 0 " + std::to_string(number) + " Shape \"sphere\"");
  }
  std::string add(const std::string& ball) {
    Bundle bundle;
    bundle.main = "scene.pbrt";
    for (const auto& [name, content] : {std::pair<std::string, std::string>("ball.pbrt", ball),
                                        std::pair<std::string, std::string>("scene.pbrt", kScene)}) {
      bundle.entries.push_back({name, sha256_hex(content), content.size()});
      farm_.blobs[bundle.entries.back().digest] = content;
    }
    farm_.bundles[bundle.digest()] = bundle;
    return bundle.digest();
  }

  TemporaryFolder folder_;
  FakeFarm farm_;
  SceneCache cache_;
  RenderSettings settings_;
};

TEST_F(SceneCacheTest, ARendererStaysWarmAcrossStopRulesButNotAcrossSettings) {
  const std::string digest = add("Translate 0 0 5 Shape \"sphere\"");
  const auto first = cache_.open(digest, settings_, nullptr);
  settings_.spp = 64;  // extended
  EXPECT_EQ(cache_.open(digest, settings_, nullptr), first);
  settings_.energy_compensation = true;
  EXPECT_NE(cache_.open(digest, settings_, nullptr), first);
  EXPECT_EQ(farm_.blobs_sent, 2);
}

TEST_F(SceneCacheTest, JobsThatDifferInTheirSamplingShareTheScene) {
  const std::string digest = add("Translate 0 0 5 Shape \"sphere\"");
  settings_.integrator = Integrator::kAuto;
  const auto pilot = cache_.open(digest, settings_, nullptr);
  farm_.bundles.clear();  // whoever builds a scene asks for its bundle
  settings_.plan = SamplingPlan{kEmissionHits | kNextEvent, 1, 1};
  const auto planned = cache_.open(digest, settings_, nullptr);
  EXPECT_NE(planned, pilot);
  EXPECT_TRUE(pilot->has_splat_layer());
  EXPECT_FALSE(planned->has_splat_layer());
  settings_.seed = 9;
  settings_.max_depth = 2;
  EXPECT_NE(cache_.open(digest, settings_, nullptr), planned);
  for (settings_.seed = 100; settings_.seed < 200; ++settings_.seed) cache_.open(digest, settings_, nullptr);
  settings_.grid = {64, 32, {0, 0, 64, 32}};
  EXPECT_THROW(cache_.open(digest, settings_, nullptr), std::out_of_range)
      << "another film is another camera";
}

TEST_F(SceneCacheTest, FurtherTilesOfAJobCostNoLoad) {
  const std::string a = ball(5), b = ball(6);
  for (int tile = 0; tile < 10; ++tile) {
    cache_.open(a, settings_, nullptr);
    cache_.open(b, settings_, nullptr);
  }
  EXPECT_EQ(cache_.scenes_built(), 2);
}

TEST_F(SceneCacheTest, ScenesUsedLastStayAsManyAsFit) {
  const std::string scenes[] = {ball(5), ball(6), ball(7), ball(8)};
  cache_.open(scenes[0], settings_, nullptr);
  const uint64_t one = cache_.warm_bytes();
  ASSERT_GT(one, 0u);
  SceneCache cache(farm_, options(3 * one + one / 2));
  for (const std::string& scene : scenes) cache.open(scene, settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 4);
  EXPECT_EQ(cache.warm_bytes(), 3 * one);
  cache.open(scenes[1], settings_, nullptr);  // used again: now the third is the oldest
  cache.open(scenes[0], settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 5);
  cache.open(scenes[1], settings_, nullptr);
  cache.open(scenes[3], settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 5) << "they stayed";
  cache.open(scenes[2], settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 6);
}

TEST_F(SceneCacheTest, TheLastSceneStaysHoweverLittleFits) {
  SceneCache cache(farm_, options(1));
  const std::string a = ball(5), b = ball(6);
  for (int tile = 0; tile < 5; ++tile) cache.open(a, settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 1);
  const auto held = cache.open(b, settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 2);
  cache.open(a, settings_, nullptr);
  EXPECT_EQ(cache.scenes_built(), 3);
  EXPECT_EQ(cache.open(b, settings_, nullptr), held)
      << "a lease held it: letting go would have freed nothing";
  EXPECT_EQ(cache.scenes_built(), 3);
}

TEST_F(SceneCacheTest, ABadSceneIsAnErrorWithItsPlace) {
  try {
    cache_.open(add("Shape 7"), settings_, nullptr);
    FAIL() << "the scene was accepted";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("ball.pbrt:1:"));
  }
}

TEST_F(SceneCacheTest, AManifestThatIsNotWhatWasAskedForIsRefused) {
  const std::string a = add("Translate 0 0 5 Shape \"sphere\""), b = add("Shape \"sphere\"");
  farm_.bundles[a] = farm_.bundles[b];
  EXPECT_THROW(cache_.open(a, settings_, nullptr), Error);
}

}  // namespace
}  // namespace lightmill::agent
