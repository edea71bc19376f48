#include "common/job/light_groups.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/job/aovs.h"
#include "common/job/settings.h"

namespace lightmill {
namespace {

TEST(LightGroups, AreTextAndBack) {
  const LightGroups groups = {"key", "Fill-2", "rest"};
  EXPECT_EQ(light_groups_text(groups), "key,Fill-2,rest");
  EXPECT_EQ(light_groups_of_text("key,Fill-2,rest"), groups);
  EXPECT_EQ(light_groups_of_text(""), LightGroups{});
}

TEST(LightGroups, WhatNoSceneHasIsRefused) {
  LightGroups most;
  for (size_t i = 0; i < kMaxLightGroups; ++i) most.push_back("g" + std::to_string(i));
  EXPECT_TRUE(valid_light_groups(most));
  most.push_back("one-more");
  EXPECT_FALSE(valid_light_groups(most));
  EXPECT_THROW(light_groups_of_text(light_groups_text(most)), Error);
  EXPECT_TRUE(valid_light_groups({std::string(kMaxLightGroupName, 'x')}));
  EXPECT_FALSE(valid_light_groups({std::string(kMaxLightGroupName + 1, 'x')}));
  for (const char* bad : {"a,a", "rest,a", "a b", "a.b", "a\n", ",a", "a,,b", "\xc3\xa4", "a_difference"})
    EXPECT_THROW(light_groups_of_text(bad), Error) << bad;
}

TEST(LightGroups, NameTheirChannels) {
  const Aovs set = kAovAlpha | kAovLightGroups;
  EXPECT_EQ(aov_channels(set, {}), std::vector<std::string>{"A"});
  EXPECT_EQ(aov_channels(set, {"key", "rest"}),
            (std::vector<std::string>{"A", "lightgroup_key.R", "lightgroup_key.G", "lightgroup_key.B",
                                      "lightgroup_rest.R", "lightgroup_rest.G", "lightgroup_rest.B"}));
  const std::vector<std::string> with_difference = aov_channels(kAovDifference | kAovLightGroups, {"key"});
  ASSERT_EQ(with_difference.size(), 9u);
  EXPECT_EQ(with_difference.front(), "difference.R");
  EXPECT_EQ(with_difference.back(), "lightgroup_key_difference.B");
}

TEST(Lobes, NameTheirChannels) {
  const std::vector<std::string> channels = aov_channels(kAovCryptoAsset | kAovLobes | kAovDifference, {});
  ASSERT_EQ(channels.size(), 3u + 12 + 27);
  EXPECT_EQ(channels[15], "diffuse_direct.R");
  EXPECT_EQ(channels[3 + 12 + 23], "volume_indirect.B");
  EXPECT_EQ(channels.back(), "emission.B");
  EXPECT_EQ(aovs_named("lobes"), kAovLobes);
  EXPECT_EQ(aov_names(aovs_named("all")), aov_names(kAllAovs));
  EXPECT_EQ(aovs_named(aov_names(kAllAovs)), kAllAovs);
}

TEST(LightGroups, ArePartOfAJobsSettings) {
  RenderSettings settings;
  settings.grid = {8, 8, {0, 0, 8, 8}};
  settings.aovs = kAovLightGroups;
  settings.light_groups = {"key", "rest"};
  const std::string json = settings_to_json(settings);
  EXPECT_EQ(settings_from_json(json).light_groups, settings.light_groups);
  EXPECT_EQ(settings_to_json(settings_from_json(json)), json);
  settings.aovs = kAovAlbedo;
  EXPECT_THROW(settings_from_json(settings_to_json(settings)), Error) << "nobody asked for groups";
}

}  // namespace
}  // namespace lightmill
