// The sample streams: nets, uniformity, independence of blocks and dimensions, no last dimension.
#include "worker/render/sampling/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/statistics.h"
#include "worker/render/sampling/dimensions.h"

namespace lightmill::test {
namespace {

SampleStream<float> stream(uint64_t position, uint64_t block, uint32_t index, uint64_t seed = 1) {
  return {stream_key(seed, kCameraStream, position, block), index};
}

// A (0,2)-sequence: every aligned run of 16 points has exactly one in every elementary interval of area 1/16.
TEST(Sobol, SixteenSamplesAreANet) {
  for (const uint32_t dim : {0u, 1u, 77u, 100000u}) {
    for (uint64_t position = 0; position < 50; ++position) {
      for (const uint32_t first : {0u, 16u, 1024u * 16u}) {
        for (int split = 0; split <= 4; ++split) {
          std::set<int> cells;
          for (uint32_t i = 0; i < 16; ++i) {
            float u, v;
            stream(position, 3, first + i).get_2d(dim, &u, &v);
            const int cols = 1 << split, rows = 16 >> split;
            cells.insert(static_cast<int>(u * static_cast<float>(cols)) * rows +
                         static_cast<int>(v * static_cast<float>(rows)));
          }
          ASSERT_EQ(cells.size(), 16u) << "dim " << dim << " split " << split;
        }
      }
    }
  }
}

TEST(Sobol, OneDimensionalSamplesAreStratified) {
  for (uint64_t position = 0; position < 200; ++position) {
    std::set<int> cells;
    for (uint32_t i = 0; i < 16; ++i) cells.insert(static_cast<int>(stream(position, 0, i).get_1d(5) * 16));
    ASSERT_EQ(cells.size(), 16u);
  }
}

// Prefixes of a block (blocks of 1, 1, 2, 4, 8) are as good as they can be.
TEST(Sobol, PowerOfTwoPrefixesAreNets) {
  for (uint64_t position = 0; position < 100; ++position) {
    for (const uint32_t n : {2u, 4u, 8u}) {
      std::set<int> us, vs;
      for (uint32_t i = 0; i < n; ++i) {
        float u, v;
        stream(position, 9, i).get_2d(2, &u, &v);
        us.insert(static_cast<int>(u * static_cast<float>(n)));
        vs.insert(static_cast<int>(v * static_cast<float>(n)));
      }
      ASSERT_EQ(us.size(), n);
      ASSERT_EQ(vs.size(), n);
    }
  }
}

TEST(Sobol, EachPointIsUniform) {
  // One point from each of many streams: independent, so plain chi^2 holds.
  int64_t family = 0;
  for (const uint32_t index : {0u, 5u, 15u}) {
    for (const uint32_t dim : {0u, 9u, vertex_dim(3, kDimNeePosition), 0xfffffff0u}) {
      std::vector<double> observed(256), expected(256, 40000.0 / 256), line(64),
          line_expected(64, 40000.0 / 64), random(64);
      for (uint64_t position = 0; position < 40000; ++position) {
        float u, v;
        const auto s = stream(position, 7, index);
        s.get_2d(dim, &u, &v);
        ASSERT_TRUE(u >= 0 && u < 1 && v >= 0 && v < 1);
        ++observed[static_cast<size_t>(u * 16) * 16 + static_cast<size_t>(v * 16)];
        ++line[static_cast<size_t>(s.get_1d(dim) * 64)];
        ++random[static_cast<size_t>(s.get_random(dim) * 64)];
      }
      EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 36)) << index << " " << dim;
      EXPECT_TRUE(chi_square_passes(chi_square(line, line_expected), 36)) << index << " " << dim;
      EXPECT_TRUE(chi_square_passes(chi_square(random, line_expected), 36)) << index << " " << dim;
      ++family;
    }
  }
  EXPECT_EQ(family, 12);
}

/// Correlation coefficient of two streams' values over many positions.
template <class A, class B>
double correlation(A&& a, B&& b, int n) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int i = 0; i < n; ++i) {
    const double x = a(static_cast<uint64_t>(i)), y = b(static_cast<uint64_t>(i));
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  return (sab - sa * sb / n) / std::sqrt((saa - sa * sa / n) * (sbb - sb * sb / n));
}

// |r| sqrt(n) is standard normal for independent values: below 4.5 for all pairs.
TEST(Sobol, BlocksPositionsDimensionsAndSeedsAreIndependent) {
  constexpr int kN = 40000;
  const double bound = 4.5 / std::sqrt(double{kN});
  const auto base = [](uint64_t p) { return stream(p, 5, 3).get_1d(8); };
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p, 6, 3).get_1d(8); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p, 5 + (1u << 20), 3).get_1d(8); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p + 1, 5, 3).get_1d(8); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p + 1920, 5, 3).get_1d(8); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p, 5, 3).get_1d(9); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p, 5, 3).get_1d(8 + kDimsPerVertex); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base, [](uint64_t p) { return stream(p, 5, 3, 2).get_1d(8); }, kN)),
            bound);
  EXPECT_LT(std::fabs(correlation(
                base,
                [](uint64_t p) {
                  return SampleStream<float>{stream_key(1, kLightStream, p, 5), 3}.get_1d(8);
                },
                kN)),
            bound);
  float u, v;
  EXPECT_LT(std::fabs(correlation(
                [&](uint64_t p) {
                  stream(p, 5, 3).get_2d(8, &u, &v);
                  return u;
                },
                [&](uint64_t p) {
                  stream(p, 5, 3).get_2d(8, &u, &v);
                  return v;
                },
                kN)),
            bound);
}

// The mean of f over a block is a batch: means of neighbouring blocks at the same pixel are uncorrelated, and
// the scrambled net has far less variance than independent samples.
TEST(Sobol, BlockMeansAreIndependentAndLessNoisy) {
  const auto mean = [](uint64_t position, uint64_t block) {
    double sum = 0;
    for (uint32_t i = 0; i < 16; ++i) {
      float u, v;
      stream(position, block, i).get_2d(4, &u, &v);
      sum += double{u} * u * v / 16;
    }
    return sum;
  };
  constexpr int kN = 8000;
  EXPECT_LT(std::fabs(correlation([&](uint64_t p) { return mean(p, 5); },
                                  [&](uint64_t p) { return mean(p, 6); }, kN)),
            4.5 / std::sqrt(double{kN}));
  std::vector<double> means;
  for (uint64_t p = 0; p < kN; ++p) means.push_back(mean(p, 5));
  const Estimate e = estimate(means);
  EXPECT_TRUE(mean_is(e, 1.0 / 6, {.resolution = 0.01}));
  const double variance = e.standard_error * e.standard_error * kN, independent = (1.0 / 15 - 1.0 / 36) / 16;
  EXPECT_LT(variance, 0.2 * independent);
}

TEST(Sobol, LanesHaveTheBitsOfScalars) {
  Random random(3);
  for (int round = 0; round < 2000; ++round) {
    Uint8 key{}, index{};
    for (int l = 0; l < 8; ++l) key[l] = random.bits(), index[l] = random.bits() % 4096;
    const uint32_t dim = random.bits();
    const SampleStream<Float8> s{key, index};
    Float8 u, v;
    s.get_2d(dim, &u, &v);
    const Float8 one = s.get_1d(dim), free = s.get_random(dim);
    for (int l = 0; l < 8; ++l) {
      const SampleStream<float> t{key[l], index[l]};
      float a, b;
      t.get_2d(dim, &a, &b);
      ASSERT_EQ(u[l], a);
      ASSERT_EQ(v[l], b);
      ASSERT_EQ(one[l], t.get_1d(dim));
      ASSERT_EQ(free[l], t.get_random(dim));
    }
  }
}

TEST(Sobol, VertexDimensionsDoNotOverlap) {
  std::set<uint32_t> seen;
  for (int vertex = 0; vertex < 100; ++vertex) {
    for (uint32_t d = 0; d < kDimsPerVertex; ++d) EXPECT_TRUE(seen.insert(vertex_dim(vertex, d)).second);
  }
  EXPECT_GT(*seen.begin(), kDimLightDirection);
}

}  // namespace
}  // namespace lightmill::test
