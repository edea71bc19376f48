// Lane i of a vector operation has the bits of the scalar one.
#include "worker/render/math/lanes.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <limits>

#include "tests/support/statistics.h"
#include "worker/render/math/compress.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/math/vec.h"

namespace lightmill::test {
namespace {

/// Floats of all magnitudes, with the special ones among them.
float any_float(Random& random) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kSpecial[] = {0.0f, -0.0f, 1.0f, -1.0f, kInf, -kInf, 0x1p-126f, 0.5f};
  if (random.bits() % 8 == 0) return kSpecial[random.bits() % 8];
  return static_cast<float>(std::ldexp(random.between(-1, 1), static_cast<int>(random.bits() % 61) - 30));
}

void expect_same(float a, float b) {
  if (a != a && b != b) return;  // the payload of a NaN is nobody's business
  ASSERT_EQ(float_bits(a), float_bits(b)) << a << " " << b;
}

TEST(Lanes, FunctionsHaveTheBitsOfScalars) {
  Random random(1);
  for (int round = 0; round < 5000; ++round) {
    Float8 a{}, b{}, c{};
    for (int l = 0; l < 8; ++l) a[l] = any_float(random), b[l] = any_float(random), c[l] = any_float(random);
    const Int8 m = a > b;
    const Float8 lo = min(a, b), hi = max(a, b), root = sqrt(abs(a)), safe = safe_sqrt(a),
                 sign = copysign(a, b), chosen = select(m, a, c), sum = a + b * c, quotient = a / b,
                 next = next_float(a, b);
    for (int l = 0; l < 8; ++l) {
      expect_same(lo[l], min(a[l], b[l]));
      expect_same(hi[l], max(a[l], b[l]));
      expect_same(root[l], sqrt(abs(a[l])));
      expect_same(safe[l], safe_sqrt(a[l]));
      expect_same(sign[l], copysign(a[l], b[l]));
      expect_same(chosen[l], select(a[l] > b[l], a[l], c[l]));
      expect_same(sum[l], a[l] + b[l] * c[l]);
      expect_same(quotient[l], a[l] / b[l]);
      expect_same(next[l], next_float(a[l], b[l]));
    }
  }
}

TEST(Lanes, MasksAndGathers) {
  float table[64];
  for (int i = 0; i < 64; ++i) table[i] = static_cast<float>(i * i);
  const Int8 index{3, 0, 63, 7, 7, 12, 1, 40};
  const Float8 got = gather(table, index);
  for (int l = 0; l < 8; ++l) EXPECT_EQ(got[l], table[index[l]]);
  const Int8 odd = (index & 1) != 0;
  EXPECT_EQ(mask_bits(odd), 0b01011101u);
  EXPECT_TRUE(any(odd));
  EXPECT_FALSE(any(mask_and(odd, mask_not(odd))));
  float out[64] = {};
  scatter(out, Int8{0, 1, 2, 3, 4, 5, 6, 7}, got, odd);
  for (int l = 0; l < 8; ++l) EXPECT_EQ(out[l], odd[l] ? got[l] : 0.0f);
}

TEST(Lanes, Transpose) {
  Float8 rows[8];
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) rows[i][j] = static_cast<float>(10 * i + j);
  }
  transpose8(rows);
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) EXPECT_EQ(rows[i][j], static_cast<float>(10 * j + i));
  }
}

// Any bits, as indices are loaded so, too; and the memory ends, as a page, with the last of them.
TEST(Lanes, TriplesAndOctetsAreWhatLiesThere) {
  constexpr int kFloats = 1024;
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  ASSERT_GE(page, kFloats * sizeof(float));
  void* const pages = mmap(nullptr, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(pages, MAP_FAILED);
  ASSERT_EQ(mprotect(static_cast<char*>(pages) + page, page, PROT_NONE), 0);
  auto* const base = reinterpret_cast<float*>(static_cast<char*>(pages) + page) - kFloats;
  for (uint32_t i = 0; i < kFloats; ++i) base[i] = bits_float(i * 0x9e3779b9u);
  const auto same = [](float a, float b) { return float_bits(a) == float_bits(b); };
  for (int i = 0; i < kFloats; ++i) {
    const Int8 near = lane_index<Float8>() * 37 + i;
    const Int8 three = near > kFloats - 3 ? kFloats - 3 : near,
               eight = near > kFloats - 8 ? kFloats - 8 : near;
    Float8 triple[3], octet[8];
    load_triples(base, three, triple);
    load_octets(base, eight, octet);
    for (int l = 0; l < 8; ++l) {
      float r[8];
      load_triples(base, three[l], r);
      for (int k = 0; k < 3; ++k)
        ASSERT_TRUE(same(triple[k][l], base[three[l] + k]) && same(r[k], triple[k][l]));
      load_octets(base, eight[l], r);
      for (int k = 0; k < 8; ++k)
        ASSERT_TRUE(same(octet[k][l], base[eight[l] + k]) && same(r[k], octet[k][l]));
    }
  }
  munmap(pages, 2 * page);
}

TEST(Lanes, FramesAreOrthonormalAndEqual) {
  Random random(2);
  for (int round = 0; round < 2000; ++round) {
    Vec3<Float8> n;
    Vec3<float> ns[8];
    for (int l = 0; l < 8; ++l) {
      ns[l] = normalize(
          Vec3<float>{static_cast<float>(random.between(-1, 1)), static_cast<float>(random.between(-1, 1)),
                      round % 5 ? static_cast<float>(random.between(-1, 1)) : (l % 2 ? -1e4f : 1e4f)});
      n.x[l] = ns[l].x, n.y[l] = ns[l].y, n.z[l] = ns[l].z;
    }
    const Frame<Float8> f(n);
    for (int l = 0; l < 8; ++l) {
      const Frame<float> g(ns[l]);
      expect_same(f.s.x[l], g.s.x);
      expect_same(f.t.z[l], g.t.z);
      EXPECT_NEAR(dot(g.s, g.s), 1, 1e-6f);
      EXPECT_NEAR(dot(g.t, g.t), 1, 1e-6f);
      EXPECT_NEAR(dot(g.s, g.t), 0, 1e-6f);
      EXPECT_NEAR(dot(g.s, ns[l]), 0, 1e-6f);
    }
  }
}

TEST(Lanes, CompressedLanesLieSideBySide) {
  const Float8 x = to_float(lane_index<Float8>()) + 0.5f;
  for (unsigned mask = 0; mask < 256; ++mask) {
    float out[8];
    int32_t index[8];
    store_compressed(out, x, mask);
    store_compressed(index, lane_index<Float8>(), mask);
    size_t n = 0;
    for (int l = 0; l < 8; ++l) {
      if (!(mask >> l & 1)) continue;
      ASSERT_EQ(index[n], l) << mask;
      ASSERT_EQ(out[n++], x[l]) << mask;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
