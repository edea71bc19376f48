// Light mixes of jobs over HTTP: what the tool would make of the job's EXR, and nothing for hostile requests.
#include "common/image/light_groups/light_mix.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "common/base/error.h"
#include "common/image/denoise/layers.h"
#include "coordinator/web/film_mark.h"
#include "coordinator/web/light_mix/light_mixes.h"
#include "coordinator/web/light_mix/mix_text.h"
#include "coordinator/web/pictures.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const LightGroups kGroups = {"key", "fill", "rest"};

std::string refusal_of(const std::string& text, const LightGroups& groups = kGroups) {
  try {
    light_factors_of_text(text, groups);
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage) << "400";
    return e.what();
  }
  return "taken";
}

TEST(LightMixText, HasAFactorForEachGroup) {
  EXPECT_THAT(light_factors_of_text("", kGroups),
              ElementsAre(LightFactor{1, 1, 1}, LightFactor{1, 1, 1}, LightFactor{1, 1, 1}));
  EXPECT_THAT(light_factors_of_text("fill:0.2/0.3/0.4,key:1.5", kGroups),
              ElementsAre(LightFactor{1.5, 1.5, 1.5}, LightFactor{0.2, 0.3, 0.4}, LightFactor{1, 1, 1}));
  EXPECT_THAT(light_factors_of_text("rest:0", kGroups)[2], ElementsAre(0, 0, 0));
  // All groups with the longest names and numbers fit in.
  LightGroups most;
  std::string text;
  for (size_t i = 0; i < kMaxLightGroups; ++i) {
    most.push_back(std::string(kMaxLightGroupName - 2, 'x') + std::to_string(10 + i));
    text += (i ? "," : "") + most.back() + ":0.0001234/123456789/0.0001234";
  }
  EXPECT_EQ(light_factors_of_text(text, most).size(), kMaxLightGroups);
}

TEST(LightMixText, IsRefusedWithWhatIsWrong) {
  const std::pair<const char*, const char*> wrong[] = {
      {"key", "NAME:FACTOR"},
      {"key=1", "NAME:FACTOR"},
      {",", "NAME:FACTOR"},
      {",key:1", "NAME:FACTOR"},
      {"key:1,,fill:1", "NAME:FACTOR"},
      {"key:1,", "last comma"},
      {":1", "no light group \"\""},
      {"Key:1", "no light group \"Key\"; it has key,fill,rest"},
      {"lamp:1", "no light group \"lamp\""},
      {"key:1,fill:2,key:1", "\"key\" comes twice"},
      {"key:", "from 0 to 1e9"},
      {"key:nan", "from 0 to 1e9"},
      {"key:inf", "from 0 to 1e9"},
      {"key:-1", "from 0 to 1e9"},
      {"key:1e10", "from 0 to 1e9"},
      {"key:1/2", "from 0 to 1e9"},
      {"key:1/2/3/4", "from 0 to 1e9"},
      {"key:1:2", "from 0 to 1e9"},
      {"key:1 ", "from 0 to 1e9"},
  };
  for (const auto& [text, why] : wrong) EXPECT_THAT(refusal_of(text), HasSubstr(why)) << text;
  EXPECT_THAT(refusal_of("key:1", {}), HasSubstr("--aov lightgroups"));
  EXPECT_THAT(refusal_of(std::string(kMaxMixText + 1, 'x')), HasSubstr("it may have 4096"));
  EXPECT_LT(refusal_of(std::string(kMaxMixText, 'x')).size(), 200u) << "what was sent is not sent back whole";
}

/// A partial with light groups: "key" has a quarter of each sum, "fill" another, and "rest" what they leave.
std::string bytes_with_groups(const LeaseGrant& grant) {
  Partial partial = fake_partial(grant.tile, grant.settings);
  partial.aovs.spec.set = kAovLightGroups;
  partial.aovs.spec.groups = grant.settings.light_groups;
  partial.aovs.groups.resize(group_layers(grant.settings.light_groups));
  for (size_t group = 0; group < partial.aovs.groups.size(); ++group) {
    const auto part = [&](ExactRgb sum) {
      for (Units& units : sum.c) units = units / 4 + group;
      return sum;
    };
    for (const ExactRgb& sum : partial.camera) partial.aovs.groups[group].camera.push_back(part(sum));
    for (const SplatSum& splat : partial.splats)
      partial.aovs.groups[group].splats.push_back({splat.pixel, part(splat.sum)});
  }
  return encode_partial(partial);
}

class LightMixesTest : public WebApiTest {
 protected:
  JobId submit(int64_t spp = 4, int width = 96, int height = 64) {
    JobRequest request = small_job(width, height, spp, Integrator::kPt);
    request.settings.aovs = kAovLightGroups;
    request.settings.light_groups = kGroups;
    return farm.submit(request);
  }
  void work_with_groups() {
    const WorkerId worker = farm.register_worker(registration());
    while (const auto grant = farm.lease(worker)) {
      ASSERT_EQ(farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, bytes_with_groups(*grant)),
                CommitResult::kAccepted);
    }
  }
  JobId rendered(int64_t spp = 4) {
    const JobId job = submit(spp);
    work_with_groups();
    return job;
  }
  std::string path(const JobId& job) const { return "/api/v1/jobs/" + job.value + "/light-mix"; }
  /// Asks until it shows all that the job has; the thread that reads the film takes its time.
  httplib::Result newest(const JobId& job, const std::string& query) {
    for (;;) {
      httplib::Result answer = http.Get(path(job) + query);
      if (!answer || (answer->status != 204 && !answer->has_header("X-Lightmill-Stale"))) return answer;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  LightMixes::Answer newest(LightMixes& mixes, const JobId& job) {
    for (;;) {
      const std::optional<LightMixes::Answer> answer = mixes.get(farm.job(job));
      if (answer && answer->current) return *answer;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
};

TEST_F(LightMixesTest, AreWhatTheToolMakesOfTheJobsImage) {
  const JobId job = rendered();
  EXPECT_EQ(http.Get(path(job) + "?mix=key:2")->status, 204) << "nobody waits";
  const auto answer = newest(job, "?mix=key:2,rest:0/0.25/3");
  ASSERT_TRUE(answer);
  ASSERT_EQ(answer->status, 200) << answer->body;
  EXPECT_EQ(answer->get_header_value("X-Lightmill-Block"), "1");

  Image image;
  const ChannelImage aovs = farm.aovs(job, &image);
  const ChannelImage file = as_channels(image, aovs);
  const LightLayers lights = find_light_layers(file, "a.exr");
  ASSERT_EQ(lights.names(), kGroups) << "they add up to the image";
  const std::vector<LightFactor> factors = {{2, 2, 2}, {1, 1, 1}, {0, 0.25, 3}};
  EXPECT_EQ(answer->body, half_picture(mix_colour(file, lights, factors).image));

  EXPECT_EQ(newest(job, "")->body, half_picture(image)) << "no mix is no change";
  EXPECT_EQ(newest(job, "?mix=")->body, http.Get("/api/v1/jobs/" + job.value + "/image")->body);
  EXPECT_EQ(newest(job, "?mix=key:2&side=48")->body.size(), 16u + 2 * 3 * 48 * 32);
}

TEST_F(LightMixesTest, AreRefusedUnlessTheyAreOfThisJob) {
  const JobId job = rendered();
  const JobId plain = farm.submit(small_job(96, 64, 4, Integrator::kPt));
  for (const std::string query : {"?mix=lamp:1", "?mix=key:nan", "?mix=key:1e300", "?mix=key:1,key:1",
                                  "?mix=key", "?mix=key:1&mix=key:2", "?mix=key:1&side=x"}) {
    EXPECT_NE(get(path(job) + query, 400)["error"], "") << query;
  }
  EXPECT_THAT(get(path(job) + "?mix=lamp:1", 400)["error"], HasSubstr("it has key,fill,rest"));
  EXPECT_THAT(get(path(plain), 400)["error"], HasSubstr("no light groups"));
  get(path(JobId{"j404"}) + "?mix=key:1", 404);
  EXPECT_EQ(http.Get(path(submit()) + "?mix=key:1")->status, 204) << "no samples yet";
}

TEST_F(LightMixesTest, FollowTheJob) {
  const JobId job = rendered();
  const auto first = newest(job, "?mix=key:2");
  const std::string tag = first->get_header_value("ETag");
  EXPECT_EQ(tag, "\"" + film_mark(farm.job(job)) + "-0-key:2\"");
  const auto ask = [&](const std::string& query) {
    return http.Get(path(job) + query, httplib::Headers{{"If-None-Match", tag}});
  };
  EXPECT_EQ(ask("?mix=key:2")->status, 304);
  EXPECT_THAT(ask("?mix=key:2")->body, IsEmpty());
  EXPECT_EQ(ask("?mix=key:3")->status, 200);
  EXPECT_EQ(ask("?mix=key:2&side=48")->status, 200);
  farm.extend(job, 8, {}, {});
  work_with_groups();
  const auto shown = http.Get(path(job) + "?mix=key:2");
  ASSERT_EQ(shown->status, 200) << "shown until there is a newer one";
  EXPECT_EQ(shown->body, first->body);
  EXPECT_TRUE(shown->has_header("X-Lightmill-Stale"));
  const auto next = newest(job, "?mix=key:2");
  EXPECT_NE(next->body, first->body);
  EXPECT_NE(next->get_header_value("ETag"), tag);
}

TEST_F(LightMixesTest, OfLargeImagesAreOfMeans) {
  const JobId job = rendered();
  LightMixes mixes(farm, 96 * 64 / 4);
  const LightMixes::Answer answer = newest(mixes, job);
  EXPECT_EQ(answer.light->block, 2);
  EXPECT_EQ(answer.light->groups, kGroups);
  const std::vector<LightFactor> ones(3, LightFactor{1, 1, 1});
  const Image mixed = mixed_image(*answer.light, ones), small = reduced(farm.image(job), 48);
  ASSERT_EQ(mixed.width, 48);
  ASSERT_EQ(mixed.height, 32);
  for (size_t i = 0; i < mixed.data.size(); ++i)
    ASSERT_NEAR(mixed.data[i], small.data[i], 1e-5 * small.data[i]);
  EXPECT_THROW(mixed_image(*answer.light, std::vector<LightFactor>(2)), std::invalid_argument);
}

TEST_F(LightMixesTest, OfSmallPicturesAreOfTheMeansOfLight) {
  const JobId job = submit(1, 2 * kSmallMix - 200, 32);
  work_with_groups();
  LightMixes mixes(farm);
  const LightMixes::Answer answer = newest(mixes, job);
  EXPECT_EQ(answer.light->block, 1);
  const std::vector<LightFactor> factors = {{2, 2, 2}, {1, 0, 1}, {0, 0.25, 3}};
  const Image whole = mixed_image(*answer.light, factors),
              small = mixed_image(*answer.light, factors, kSmallMix);
  const Image means = reduced(whole, kSmallMix);
  EXPECT_EQ(whole.width, 2 * kSmallMix - 200);
  ASSERT_EQ(small.width, means.width);
  ASSERT_EQ(small.height, means.height);
  for (size_t i = 0; i < means.data.size(); ++i)
    ASSERT_NEAR(small.data[i], means.data[i], 1e-5 * means.data[i]);
  EXPECT_EQ(mixed_image(*answer.light, factors, 100).width, whole.width) << "that is of smaller blocks";
  EXPECT_EQ(newest(job, "?mix=key:2&side=800")->body.size(), 16u + 2 * 3 * 700 * 16);
  EXPECT_EQ(newest(job, "?mix=key:2&side=100")->body.size(), 16u + 2 * 3 * 100 * 3);
}

TEST_F(LightMixesTest, KeepTheLightOfTheJobsLastLookedAt) {
  const JobId a = rendered(), b = rendered(), c = rendered();
  LightMixes mixes(farm, LightMixes::kMostPixels, size_t{2 * 96 * 64 * 12 * sizeof(float)});
  newest(mixes, a);
  newest(mixes, b);
  EXPECT_TRUE(mixes.get(farm.job(a)));
  newest(mixes, c);
  EXPECT_TRUE(mixes.get(farm.job(a)));
  EXPECT_FALSE(mixes.get(farm.job(b))) << "the least recently used";
}

}  // namespace
}  // namespace lightmill
