#include "common/image/box_means.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightmill {
namespace {

using ::testing::ElementsAre;

TEST(BoxMeans, AreThoseOfTheBoxesThatLieWhollyInTheImage) {
  Image image(5, 3, 2);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      image.pixel(x, y)[0] = static_cast<float>(10 * y + x);
      image.pixel(x, y)[1] = x < 2 ? 1.0f : -2.0f;
    }
  }
  const Image means = box_means(image, 2);
  EXPECT_EQ(means.width, 2);
  EXPECT_EQ(means.height, 1);
  EXPECT_EQ(means.channels, 2);
  // (0 + 1 + 10 + 11) / 4 and (2 + 3 + 12 + 13) / 4; the last column and row belong to no box.
  EXPECT_THAT(means.data, ElementsAre(5.5f, 1, 7.5f, -2));
}

TEST(BoxMeans, OfOnePixelAreTheImage) {
  Image image(3, 2);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.1f * static_cast<float>(i);
  EXPECT_EQ(box_means(image, 1).data, image.data);
}

TEST(BoxMeans, HaveNoColumnsOrRowsWhereNoBoxFits) {
  const Image wide = box_means(Image(9, 3), 4);
  EXPECT_EQ(wide.width, 2);
  EXPECT_EQ(wide.height, 0);
  EXPECT_TRUE(wide.data.empty());
  const Image high = box_means(Image(3, 9), 4);
  EXPECT_EQ(high.width, 0);
  EXPECT_EQ(high.height, 2);
  EXPECT_TRUE(high.data.empty());
  EXPECT_TRUE(box_means(Image(), 4).data.empty());
}

TEST(BoxMeans, ManySmallValuesAreNotLostBesideALargeOne) {
  Image image(32, 32, 1);
  for (float& value : image.data) value = 1;
  image.data[0] = 1e8f;  // in floats the ones after it would change nothing
  EXPECT_FLOAT_EQ(box_means(image, 32).data.at(0), static_cast<float>((1e8 + 1023) / 1024));
}

}  // namespace
}  // namespace lightmill
