#include "common/scene/lights/light_group_name.h"

#include <gtest/gtest.h>

#include <string>

#include "common/job/light_groups.h"

namespace lightmill {
namespace {

TEST(LightGroupName, LettersDigitsUnderscoreAndMinusStay) {
  const LightGroupName group = light_group_name("Key-Light_2");
  EXPECT_EQ(group.name, "Key-Light_2");
  EXPECT_EQ(group.change, "");
}

TEST(LightGroupName, OtherCharactersBecomeUnderscores) {
  EXPECT_EQ(light_group_name("key light.R").name, "key_light_R");
  EXPECT_EQ(light_group_name("\xd1\x81\xd0\xb2\xe2\x82\xac").name, "___")
      << "one a character, not one a byte";
  EXPECT_NE(light_group_name("a b").change.find("\"a b\" gets the name \"a_b\""), std::string::npos)
      << light_group_name("a b").change;
}

TEST(LightGroupName, LongOnesAreCut) {
  const std::string longest(kMaxLightGroupName, 'x');
  EXPECT_EQ(light_group_name(longest).change, "");
  EXPECT_EQ(light_group_name(longest + "y").name, longest);
  EXPECT_NE(light_group_name(longest + "y").change, "");
}

TEST(LightGroupName, NoneHasTheNameOfTheRest) {
  for (const char* given : {"", "rest"}) {
    EXPECT_EQ(light_group_name(given).name, "") << given;
    EXPECT_EQ(light_group_name(given).change, "") << given;
  }
  EXPECT_EQ(light_group_name("Rest").name, "Rest");
}

TEST(LightGroupName, NoneIsThatOfADifference) {
  EXPECT_EQ(light_group_name("key_difference").name, "key_differenc_");
  EXPECT_EQ(light_group_name("difference").name, "difference");
}

}  // namespace
}  // namespace lightmill
