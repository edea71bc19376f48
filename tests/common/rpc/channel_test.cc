#include "common/rpc/channel.h"

#include <gtest/gtest.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

TEST(Address, Parses) {
  EXPECT_EQ(parse_address("localhost:7070").host, "localhost");
  EXPECT_EQ(parse_address("localhost:7070").port, 7070);
  EXPECT_EQ(parse_address("[::1]:80").host, "::1");
  EXPECT_EQ(parse_address("7070").host, "localhost");
  EXPECT_EQ(parse_address("a.b.example:0").port, 0);
}

TEST(Address, RefusesTheRest) {
  for (const char* bad : {"", ":", ":1", "host:", "host:x", "host:70000", "host:-1", "host:1 ", "::1:80",
                          "a b:1", "http://host:1", "host:1:2", "host:+1", "host:0x10"}) {
    EXPECT_THROW(parse_address(bad), Error) << bad;
  }
}

TEST(Address, LoopbackByTheText) {
  for (const char* name : {"localhost", "127.0.0.1", "127.1.2.3", "::1", "[::1]"})
    EXPECT_TRUE(is_loopback(name));
  for (const char* name : {"0.0.0.0", "::", "10.0.0.1", "example.org", "127.0.0.1.example.org", "127.0.0",
                           "127.", "127.0.0.256", "127.0.0.1.", "localhost.example.org", ""}) {
    EXPECT_FALSE(is_loopback(name)) << name;
  }
}

TEST(PlainText, OnlyToLoopbackUnlessInsecure) {
  EXPECT_NO_THROW(require_plain_text_allowed("127.0.0.1:1", false));
  EXPECT_NO_THROW(require_plain_text_allowed("farm.example.org:7070", true));
  try {
    require_plain_text_allowed("farm.example.org:7070", false);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("--insecure"), std::string::npos);
    EXPECT_EQ(e.exit_code(), 2);
  }
  EXPECT_THROW(make_channel({"10.1.1.1:7070", false}), Error);
}

}  // namespace
}  // namespace lightmill
