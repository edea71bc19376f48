#include "common/base/json/json_text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace lightmill {
namespace {

TEST(JsonText, ReadsBackTheSame) {
  const std::string odd = "a \"quoted\" back\\slash\n\x01 \xc3\xa4";
  JsonText inner, text;
  inner.add("count", std::numeric_limits<uint64_t>::max());
  const std::string written = text.add("text", odd)
                                  .add("name", "plain")
                                  .add("least", std::numeric_limits<int64_t>::min())
                                  .add("no", false)
                                  .add("tenth", 0.1)
                                  .add("whole", 2.0)
                                  .add("large", 1e300)
                                  .add_raw("inner", inner.end())
                                  .end();
  const nlohmann::json j = nlohmann::json::parse(written);
  EXPECT_EQ(j.size(), 8u);
  EXPECT_EQ(j.at("text").get<std::string>(), odd);
  EXPECT_EQ(j.at("name").get<std::string>(), "plain");
  EXPECT_EQ(j.at("least").get<int64_t>(), std::numeric_limits<int64_t>::min());
  EXPECT_EQ(j.at("no"), false);
  EXPECT_EQ(j.at("tenth").get<double>(), 0.1);
  EXPECT_TRUE(j.at("whole").is_number_float());
  EXPECT_EQ(j.at("large").get<double>(), 1e300);
  EXPECT_EQ(j.at("inner").at("count").get<uint64_t>(), std::numeric_limits<uint64_t>::max());
}

TEST(JsonText, OfNothingAndOfWhatIsNoText) {
  EXPECT_EQ(JsonText().end(), "{}");
  EXPECT_EQ(nlohmann::json::parse(JsonText().add("name", std::string("\xff")).end()).at("name"),
            "\xef\xbf\xbd");
}

}  // namespace
}  // namespace lightmill
