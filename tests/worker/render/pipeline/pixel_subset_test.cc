#include "worker/render/pipeline/pixel_subset.h"

#include <gtest/gtest.h>

#include <set>

namespace lightmill {
namespace {

TEST(PixelSubset, KeepsOnePixelOfEveryRectangle) {
  for (int bits = 0; bits <= 8; ++bits) {
    const PixelSubset pixel_subset{1u << bits};
    const int wide = 1 << (bits + 1) / 2, high = 1 << bits / 2;
    std::set<int> places;
    for (int row = 0; row < 32; ++row) {
      for (int column = 0; column < 32; ++column) {
        int kept = 0;
        for (int i = 0; i < wide * high; ++i) {
          if (!pixel_subset.keeps(column * wide + i % wide, row * high + i / wide)) continue;
          ++kept;
          places.insert(i);
        }
        EXPECT_EQ(kept, 1) << pixel_subset.one_in << ": " << column << ", " << row;
      }
    }
    // No pattern: of 256 places 1,024 rectangles leave out e^-4 by chance, of fewer places fewer.
    EXPECT_GT(places.size(), static_cast<size_t>(wide * high) * 95 / 100);
  }
}

}  // namespace
}  // namespace lightmill
