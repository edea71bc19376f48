// Ids of names, against numbers that others publish.
#include "common/image/cryptomatte/cryptomatte_hash.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill {
namespace {

TEST(CryptomatteHash, MurmurHashOfKnownTexts) {
  EXPECT_EQ(murmur_hash3(""), 0u);
  EXPECT_EQ(murmur_hash3("a"), 0x3c2569b2u);
  EXPECT_EQ(murmur_hash3("aa"), 0x371091a9u);
  EXPECT_EQ(murmur_hash3("aaa"), 0xb4d05fb7u);
  EXPECT_EQ(murmur_hash3("aaaa"), 0x7eeed987u);
  EXPECT_EQ(murmur_hash3("abc"), 0xb3dd93fau);
  EXPECT_EQ(murmur_hash3("test"), 0xba6bd213u);
  EXPECT_EQ(murmur_hash3("hello"), 0x248bfa47u);
  EXPECT_EQ(murmur_hash3("Hello, world!"), 0xc0363e43u);
  EXPECT_EQ(murmur_hash3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
}

// The sample manifest of the specification.
TEST(CryptomatteHash, IdsOfTheSpecification) {
  EXPECT_EQ(cryptomatte_hex("bunny"), "13851a76");
  EXPECT_EQ(cryptomatte_hex("default"), "42c9679f");
}

// As in files of Arnold and Gaffer.
TEST(CryptomatteHash, KeysAndIdsOfOtherRenderers) {
  EXPECT_EQ(cryptomatte_prefix("crypto_object"), "cryptomatte/f834d0a/");
  const char* head = "/GAFFERBOT/C_torso_GRP/C_head_GRP/C_head_CPT/C_head001_REN";
  EXPECT_EQ(murmur_hash3(head), 4226998693u);
  EXPECT_FLOAT_EQ(cryptomatte_id(head), -2.52222490915e+36f);
}

TEST(CryptomatteHash, NoIdIsZeroDenormalInfiniteOrNan) {
  int flipped = 0;
  for (int i = 0; i < 100'000; ++i) {
    const std::string name = "shape " + std::to_string(i);
    ASSERT_TRUE(std::isnormal(cryptomatte_id(name))) << name;
    const uint32_t change = cryptomatte_bits(name) ^ murmur_hash3(name);
    ASSERT_TRUE(change == 0 || change == 1u << 23) << name;
    flipped += change != 0;
  }
  EXPECT_NEAR(flipped, 100'000.0 * 2 / 256, 120);
  EXPECT_EQ(cryptomatte_hex("shape 274"), "80ffeca9");  // 807feca9: a denormal
  EXPECT_EQ(cryptomatte_hex("shape 404"), "ff3ed3d6");  // ffbed3d6: NaN
}

}  // namespace
}  // namespace lightmill
