// How the module that reads and writes images is loaded, and which is refused.
#include "common/image/image_library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <xmmintrin.h>

#include <exception>
#include <fstream>
#include <set>
#include <thread>

#include "common/base/error.h"
#include "common/build_id/build_id.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TempFolder;

/// One of fake_module.cc's.
std::string fake(const std::string& name) { return LIGHTMILL_FAKE_MODULES "/" + name + ".so"; }

std::string refusal(const std::string& path) {
  try {
    load_image_library(path);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), 1);
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    EXPECT_THAT(e.what(), HasSubstr(path + ": the module that reads and writes images "));
    return e.what();
  }
  return "accepted";
}

TEST(ImageLibrary, IsLoadedOnceByAnyThread) {
  std::vector<const ImageLibrary*> seen(8);
  std::vector<std::thread> threads;
  for (const ImageLibrary*& library : seen) threads.emplace_back([&library] { library = &image_library(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(std::set(seen.begin(), seen.end()).size(), 1u);
  EXPECT_EQ(image_library().build, build_id());
  EXPECT_STREQ(image_library().version_built, image_library().version_running);
  EXPECT_THAT(build_id(), HasSubstr(std::string("OpenImageIO ") + image_library().version_running));
}

TEST(ImageLibrary, LoadingLeavesSignalsAndFloatModeAsTheyWere) {
  const std::terminate_handler terminate = std::get_terminate();
  const unsigned mode = _mm_getcsr();
  sigset_t blocked, blocked_after;
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  struct sigaction mine {
  }, after{}, before{};
  mine.sa_handler = [](int) {};
  sigaction(SIGBUS, &mine, &before);
  EXPECT_THAT(refusal(fake("other_build")), HasSubstr("is of another build"));
  sigaction(SIGBUS, &before, &after);
  EXPECT_EQ(after.sa_handler, mine.sa_handler);
  EXPECT_EQ(std::get_terminate(), terminate);
  EXPECT_EQ(_mm_getcsr(), mode);
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked_after);
  EXPECT_EQ(sigismember(&blocked_after, SIGTERM), sigismember(&blocked, SIGTERM));
}

TEST(ImageLibrary, WhatDoesNotFitIsRefused) {
  EXPECT_THAT(refusal(fake("other_build")),
              AllOf(HasSubstr("is of another build (lightmill 0.0.0) than the program (" + build_id() + ")"),
                    HasSubstr("copy both from one build")));
  EXPECT_THAT(refusal(fake("other_version")),
              HasSubstr("was built with OpenImageIO 2.0.1 and runs with 2.0.2, which may read other values; "
                        "install the former, or build again"));
  EXPECT_THAT(refusal(fake("stranger")), HasSubstr("is something else"));
  const TempFolder folder;
  EXPECT_THAT(refusal(folder / "none.so"), HasSubstr("is not there; copy it"));
  std::ofstream(folder / "text.so") << "no library";
  EXPECT_THAT(refusal(folder / "text.so"), HasSubstr("can't be loaded: "));
}

/// As where a limit of the system is in a library's way. No destructor runs on the way out: some wait for
/// ever.
TEST(ImageLibraryDeathTest, AConstructorThatThrowsOrCrashesEndsTheProgramWithALine) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const char* name : {"throws", "aborts", "crashes"}) {
    const auto load = [&] {
      try {
        load_image_library(fake(name));
      } catch (...) {
        std::fputs("caught\n", stderr);
        std::exit(3);
      }
    };
    EXPECT_EXIT(load(), ::testing::ExitedWithCode(1), "its libraries can't start: too little memory") << name;
  }
}

}  // namespace
}  // namespace lightmill
