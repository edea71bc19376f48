#include "common/base/json/json_depth.h"

#include <gtest/gtest.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

TEST(JsonSize, BoundsNestingAndValues) {
  EXPECT_NO_THROW(check_json_size(R"({"a": [1, 2], "b": "[[[{{,,,"})", 2, 5));
  EXPECT_THROW(check_json_size("[[[1]]]", 2, 100), Error);
  EXPECT_THROW(check_json_size("[0, 0, 0, 0]", 2, 3), Error);
  EXPECT_THROW(check_json_size("[{}, {}]", 2, 3), Error);
  EXPECT_NO_THROW(check_json_size("[{}, {}]", 2, 4));
}

}  // namespace
}  // namespace lightmill
