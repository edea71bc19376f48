// Factors of light groups as text, some of it hostile.
#include "common/image/light_groups/light_factor.h"

#include <gmock/gmock.h>

#include <string>

namespace lightmill {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;

TEST(LightFactorText, IsOneNumberOrThree) {
  EXPECT_THAT(light_factor_of_text("1.5", ','), Optional(ElementsAre(1.5, 1.5, 1.5)));
  EXPECT_THAT(light_factor_of_text("0", '/'), Optional(ElementsAre(0, 0, 0)));
  EXPECT_THAT(light_factor_of_text("0.2/3e-1/1e9", '/'),
              Optional(ElementsAre(0.2, 0.3, kLargestLightFactor)));
  EXPECT_THAT(light_factor_of_text("1,0.9,0.8", ','), Optional(ElementsAre(1, 0.9, 0.8)));
}

TEST(LightFactorText, IsNothingElse) {
  for (const std::string text :
       {"",        " ",       "1 ",          " 1",   "1/",    "/1",     "1/2",  "1/2/", "1/2/3/",
        "1/2/3/4", "1//3",    "1,2,3",       "-1",   "-1e-9", "+1",     "nan",  "NaN",  "inf",
        "1/nan/1", "1/1/inf", "1.0000001e9", "1e10", "1e400", "1e-400", "0x10", "1e",   "one"}) {
    EXPECT_FALSE(light_factor_of_text(text, '/')) << text;
  }
  EXPECT_FALSE(light_factor_of_text(std::string("1\0", 2), '/'));
  EXPECT_FALSE(light_factor_of_text(std::string(100'000, '/'), '/'));
}

}  // namespace
}  // namespace lightmill
