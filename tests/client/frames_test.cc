// --frames, patterns of names, and lists of files.
#include "client/frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <sstream>

#include "common/base/error.h"

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;

std::string error_of_frames(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage);
    return e.what();
  }
  return "no error";
}

TEST(Frames, RangesStepsAndLists) {
  EXPECT_EQ(parse_frames("5"), std::vector{5});
  EXPECT_EQ(parse_frames("1-4"), (std::vector{1, 2, 3, 4}));
  EXPECT_EQ(parse_frames("1-10x4"), (std::vector{1, 5, 9}));
  EXPECT_EQ(parse_frames("-2-1"), (std::vector{-2, -1, 0, 1}));
  EXPECT_EQ(parse_frames("-3--1"), (std::vector{-3, -2, -1}));
  EXPECT_EQ(parse_frames("7,1-3,2,7"), (std::vector{7, 1, 2, 3}));
  EXPECT_EQ(parse_frames("1-20000").size(), 20000u);
  for (const char* bad : {"", "x", "1-", "1-2x", "1-2x0", "1-2x-1", "2-1", "1,", ",1", "1 2", "1-20001",
                          "0-1000000000", "1-2-3", "99999999999", "1.5", "1-3,x"}) {
    EXPECT_THAT(error_of_frames([&] { parse_frames(bad); }), HasSubstr("expected numbers and ranges")) << bad;
  }
}

TEST(Frames, Durations) {
  EXPECT_EQ(parse_duration("90", "--budget"), 90);
  EXPECT_EQ(parse_duration("1.5h", "--budget"), 5400);
  EXPECT_EQ(parse_duration("30m", "--budget"), 1800);
  EXPECT_EQ(parse_duration("2d", "--budget"), 172800);
  for (const char* bad : {"", "h", "0", "-1h", "1w", "1 h", "1e300", "nan", "inf"})
    EXPECT_THAT(error_of_frames([&] { parse_duration(bad, "--budget"); }), HasSubstr("--budget")) << bad;
}

TEST(Frames, PatternsOfNames) {
  const auto name = [](const char* pattern, int frame) {
    return FramePattern::find(pattern)->name_of(frame);
  };
  EXPECT_EQ(name("shot.%04d.exr", 17), "shot.0017.exr");
  EXPECT_EQ(name("shot.%d.exr", 17), "shot.17.exr");
  EXPECT_EQ(name("shot_####.exr", 12345), "shot_12345.exr");
  EXPECT_EQ(name("shot_####.exr", -12), "shot_-012.exr");
  EXPECT_EQ(name("50%%_#.png", 3), "50%_3.png");
  EXPECT_FALSE(FramePattern::find("shot.exr"));
  EXPECT_FALSE(FramePattern::find("50%%.exr"));
  EXPECT_THAT(error_of_frames([] { FramePattern::find("a#b#.exr"); }), HasSubstr("two places"));
  for (const char* bad : {"a%s.exr", "a%4d.exr", "a%", "a%0d.exr", "a%012d.exr", "a%n"})
    EXPECT_THAT(error_of_frames([&] { FramePattern::find(bad); }), HasSubstr("printf")) << bad;
  EXPECT_THAT(error_of_frames([] { FramePattern::require("shot.exr", "-o"); }), HasSubstr("-o shot.exr"));
}

TEST(Frames, OfAnAnimationAreTimes) {
  SceneOptions scene;
  scene.scene = "walk.glb";
  scene.fps = 25;
  FrameOptions options;
  options.frames = "0-50x25";
  std::istringstream none;
  const auto frames = scene_frames(scene, options, none);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[2].number, 50);
  EXPECT_EQ(frames[2].time, 2.0);
  EXPECT_EQ(frames[2].file, "walk.glb");
  scene.pose.time = 1;
  EXPECT_THAT(error_of_frames([&] { scene_frames(scene, options, none); }), HasSubstr("--time-of"));
  scene.pose.time.reset();
  scene.scene = "still.pbrt";
  EXPECT_THAT(error_of_frames([&] { scene_frames(scene, options, none); }), HasSubstr("scene.%04d.pbrt"));
}

TEST(Frames, OfFilesAreNamedByPatternOrList) {
  SceneOptions scene;
  scene.scene = "there/is/no/such.%03d.pbrt";
  FrameOptions options;
  options.frames = "9-10";
  std::istringstream list("a.pbrt\r\n\nb c.pbrt \n");
  const auto files = scene_frames(scene, options, list);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].file, "there/is/no/such.009.pbrt");
  EXPECT_FALSE(files[0].time);
  scene.scene = "-";
  options.frames = "";
  const auto listed = scene_frames(scene, options, list);
  ASSERT_EQ(listed.size(), 2u);
  EXPECT_EQ(listed[1].number, 2);
  EXPECT_EQ(listed[1].file, "b c.pbrt");
  options.frames = "1-3";
  std::istringstream again("a.pbrt\nb.pbrt\n"), empty;
  EXPECT_THAT(error_of_frames([&] { scene_frames(scene, options, again); }), HasSubstr("names 2 files"));
  EXPECT_THAT(error_of_frames([&] { scene_frames(scene, options, empty); }), HasSubstr("no file is named"));
}

TEST(Frames, OptionsOfSequencesNeedFrames) {
  SceneOptions scene;
  scene.scene = "a%20b#.gltf";
  FrameOptions options;
  EXPECT_FALSE(wants_frames(scene, options)) << "a name is a name";
  options.order = "coarse-first";
  EXPECT_THAT(error_of_frames([&] { wants_frames(scene, options); }), HasSubstr("--frames"));
}

}  // namespace
}  // namespace lightmill::client
