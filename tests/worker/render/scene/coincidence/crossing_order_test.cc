// In which order sheets lie that coincide.
#include "worker/render/scene/coincidence/crossing_order.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

using Order = std::vector<size_t>;

Sheet passes(int facing, double size, uint64_t place, MediumInterface media = {}) {
  return {facing, true, false, false, media, size, place};
}
Sheet opaque(int facing, double size, uint64_t place, bool flat = false) {
  Sheet s = passes(facing, size, place);
  s.passes = false;
  s.flat = flat;
  return s;
}

TEST(CrossingOrder, BodiesThatTouchAreLeftBeforeTheNextIsEntered) {
  EXPECT_EQ(crossing_order({passes(-1, 1, 0), passes(1, 1, 1)}), (Order{1, 0}));
  EXPECT_EQ(crossing_order({passes(1, 1, 0), passes(-1, 5, 1)}), (Order{0, 1}));
}

TEST(CrossingOrder, TheSmallerOfNestedBodiesIsTheInnerOne) {
  EXPECT_EQ(crossing_order({passes(1, 2, 0), passes(1, 1, 1)}), (Order{1, 0}));
  EXPECT_EQ(crossing_order({passes(-1, 2, 0), passes(-1, 1, 1)}), (Order{0, 1}));
}

TEST(CrossingOrder, MediaSayWhichBodyIsInWhich) {
  // The larger one lies in the medium of the smaller one.
  EXPECT_EQ(crossing_order({passes(1, 2, 0, {1, 0}), passes(1, 1, 1, {0, -1})}), (Order{0, 1}));
  // What contradicts itself says nothing.
  EXPECT_EQ(crossing_order({passes(1, 2, 0, {1, 0}), passes(1, 1, 1, {0, 1})}), (Order{1, 0}));
}

TEST(CrossingOrder, DecalsLieInFrontAndLaterOnesOnTop) {
  EXPECT_EQ(crossing_order({opaque(1, 1, 0, true), opaque(1, 2, 1, true)}), (Order{1, 0}));
  EXPECT_EQ(crossing_order({opaque(-1, 1, 0, true), opaque(-1, 2, 1, true)}), (Order{0, 1}));
  EXPECT_EQ(crossing_order({opaque(1, 1, 0), opaque(1, 1, 1)}), (Order{0, 1}));
  // On glass, too; but what is solid lies within it.
  EXPECT_EQ(crossing_order({opaque(1, 1, 0, true), passes(1, 2, 1)}), (Order{1, 0}));
  EXPECT_EQ(crossing_order({opaque(1, 1, 0), passes(1, 2, 1)}), (Order{0, 1}));
  // A pane in a wall hides nothing.
  EXPECT_EQ(crossing_order({opaque(1, 2, 0, true), passes(1, 1, 1)}), (Order{0, 1}));
}

TEST(CrossingOrder, AnEmitterLiesOnTheSideThatItShinesTo) {
  Sheet lamp = opaque(-1, 1, 0, true);
  lamp.emits_one_sided = true;
  EXPECT_EQ(crossing_order({lamp, opaque(1, 2, 1, true)}), (Order{0, 1}));
  lamp.facing = 1;
  EXPECT_EQ(crossing_order({lamp, opaque(-1, 2, 1, true)}), (Order{1, 0}));
}

TEST(StepsApart, OnlyWhatOverlapsIsApartAndTheLargestStays) {
  const std::vector<Sheet> wall_and_decals{opaque(1, 1, 0, true), opaque(1, 1, 1, true),
                                           opaque(1, 9, 2, true), opaque(1, 0.5, 3, true)};
  EXPECT_EQ(steps_apart(wall_and_decals, {{0, 2}, {1, 2}, {1, 3}, {2, 3}}), (std::vector<int>{1, 1, 0, 2}));
  EXPECT_EQ(steps_apart({passes(1, 1, 0), passes(1, 2, 1)}, {{0, 1}}), (std::vector<int>{-1, 0}));
}

TEST(StepsApart, NoStackIsHigherThanItMayBe) {
  std::vector<Sheet> sheets;
  std::vector<std::pair<size_t, size_t>> touching;
  for (size_t i = 0; i < 1000; ++i) {
    sheets.push_back(opaque(1, 1, i));
    if (i > 0) touching.emplace_back(i - 1, i);
  }
  const std::vector<int> steps = steps_apart(sheets, touching);
  EXPECT_EQ(steps[0], 0);
  EXPECT_EQ(steps[5], 5);
  EXPECT_EQ(steps[999], 32);
}

}  // namespace
}  // namespace lightmill
