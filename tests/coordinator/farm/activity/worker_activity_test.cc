// What is remembered of a worker's hour: exact seconds, spans of cells, and a bound.
#include "coordinator/farm/activity/worker_activity.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill {
namespace {

const JobId kOne{"j1"}, kTwo{"j2"}, kFrame{"s1.3"};

TEST(WorkerActivity, CountsTheTimeThatItHoldsATile) {
  WorkerActivity activity(3);
  activity.begin(kOne, 5);
  activity.begin(kOne, 6);  // the next one, while it renders
  activity.end(kOne, true, 8);
  activity.end(kOne, true, 9);
  activity.begin(kTwo, 27);
  activity.end(kTwo, false, 28);
  EXPECT_DOUBLE_EQ(activity.busy_seconds(33), 5);
  EXPECT_DOUBLE_EQ(activity.present_seconds(33), 30);
  const auto spans = activity.spans(33);
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].job, kOne);
  EXPECT_EQ(spans[0].cell, 0);
  EXPECT_EQ(spans[0].cells, 1);
  EXPECT_EQ(spans[0].tiles, 2);
  EXPECT_DOUBLE_EQ(spans[0].busy_seconds, 4);
  EXPECT_EQ(spans[1].cell, 2);
  EXPECT_EQ(spans[1].tiles, 0) << "it came to nothing";
}

TEST(WorkerActivity, ACellBelongsToTheJobThatHadMostOfIt) {
  WorkerActivity activity(0);
  activity.begin(kOne, 0);
  activity.end(kOne, true, 4);
  activity.begin(kTwo, 4);
  activity.end(kTwo, true, 9);
  activity.begin(kOne, 9);
  EXPECT_EQ(activity.spans(10)[0].job, kOne) << "of two equal ones the first";
  const auto spans = activity.spans(25);
  ASSERT_EQ(spans.size(), 1u);
  EXPECT_EQ(spans[0].cells, 3);
  EXPECT_DOUBLE_EQ(spans[0].busy_seconds, 25);
  activity.end(kOne, true, 31);
  activity.begin(kFrame, 31);
  ASSERT_EQ(activity.spans(45).size(), 2u);
  EXPECT_EQ(activity.spans(45)[1].job, kFrame);
  EXPECT_EQ(activity.spans(45)[1].cell, 3);
  EXPECT_EQ(activity.spans(45, 2).size(), 2u) << "the first one ends after cell 2";
  EXPECT_EQ(activity.spans(45, 3).size(), 1u);
}

TEST(WorkerActivity, RemembersAnHour) {
  WorkerActivity activity(0);
  activity.begin(kOne, 0);
  activity.end(kOne, true, 1000);
  EXPECT_DOUBLE_EQ(activity.busy_seconds(3600), 1000);
  EXPECT_DOUBLE_EQ(activity.busy_seconds(4100), 500) << "the part that is within the hour";
  EXPECT_DOUBLE_EQ(activity.present_seconds(4100), 3600);
  EXPECT_DOUBLE_EQ(activity.busy_seconds(1e9), 0) << "and nothing takes long after a long time";
  activity.begin(kTwo, 1e9);
  EXPECT_DOUBLE_EQ(activity.busy_seconds(2e9), 3600);
  EXPECT_EQ(activity.spans(2e9).size(), 1u);
}

TEST(WorkerActivity, IsBoundedWhateverHappens) {
  WorkerActivity activity(0);
  std::mt19937 random(7);
  double now = 0, busy = 0;
  for (int i = 0; i < 200000; ++i) {
    const JobId job{"j" + std::to_string(random() % 40)};
    now += 0.001 * static_cast<double>(random() % 100);
    activity.begin(job, now);
    const double seconds = 0.001 * static_cast<double>(random() % 100);
    now += seconds;
    busy += seconds;
    activity.end(job, true, now);
    if (i == 20000) EXPECT_NEAR(activity.busy_seconds(now), busy, 1e-6) << "within the first hour";
  }
  const auto spans = activity.spans(now);
  EXPECT_LE(spans.size(), 361u);
  EXPECT_NEAR(activity.busy_seconds(now), 1800, 60);
  for (size_t i = 1; i < spans.size(); ++i) EXPECT_GE(spans[i].cell, spans[i - 1].cell + spans[i - 1].cells);
}

TEST(WorkerActivity, TakesWhatDoesNotFit) {
  WorkerActivity activity(10);
  activity.end(kOne, true, 12);  // never began
  activity.begin(kOne, 5);       // before it came
  EXPECT_DOUBLE_EQ(activity.busy_seconds(14), 2);
}

}  // namespace
}  // namespace lightmill
