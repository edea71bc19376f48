// Thumbnails: made once a job has ended, kept over restarts, bounded, and none of a film that does not
// change.
#include "coordinator/web/thumbnails/thumbnails.h"

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::StartsWith;

constexpr char kPngMagic[] = "\x89PNG";

size_t files_in(const std::string& folder) {
  size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  return count;
}

class ThumbnailStoreTest : public ::testing::Test {
 protected:
  static std::string picture(char fill, size_t bytes = 100) { return std::string(bytes, fill); }
  TemporaryFolder folder;
};

TEST_F(ThumbnailStoreTest, KeepsTheNewestOfEachJobOverARestart) {
  const std::string path = folder.file("thumbnails");
  {
    ThumbnailStore store(path, {}, {});
    EXPECT_FALSE(store.find(JobId{"j1"}));
    store.put(JobId{"j1"}, "1-10", picture('a'));
    store.put(JobId{"j1"}, "2-20", picture('b'));
    store.put(JobId{"s1.-3"}, "5-5", picture('c'));
    EXPECT_EQ(files_in(path), 2u);
  }
  std::ofstream(path + "/half.png.part") << "left by a crash";
  std::ofstream(path + "/j9_1-1.png");
  ThumbnailStore store(path, {}, {});
  EXPECT_EQ(files_in(path), 2u) << "what is no thumbnail goes";
  const auto found = store.find(JobId{"j1"});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->mark, "2-20");
  EXPECT_EQ(*found->png, picture('b'));
  EXPECT_EQ(store.find(JobId{"s1.-3"}).value().mark, "5-5");
  std::filesystem::remove(path + "/j1_2-20.png");
  EXPECT_TRUE(store.find(JobId{"j1"})) << "it is in memory";
  ThumbnailStore other(path, {}, {});
  EXPECT_FALSE(other.find(JobId{"j1"}));
}

TEST_F(ThumbnailStoreTest, IsBoundedInMemoryAndOnTheDisk) {
  const std::string path = folder.file("thumbnails");
  ThumbnailStore store(path, {}, {.memory_bytes = 300, .files = 5, .file_bytes = 1000});
  for (int i = 0; i < 20; ++i) store.put(JobId{"j" + std::to_string(i)}, "1-1", picture('a'));
  EXPECT_EQ(files_in(path), 5u);
  EXPECT_FALSE(store.find(JobId{"j14"}));
  EXPECT_TRUE(store.find(JobId{"j15"})) << "read from its file";
  store.put(JobId{"j20"}, "1-1", picture('b', 700));
  EXPECT_EQ(files_in(path), 4u) << "1000 bytes";
  EXPECT_TRUE(store.find(JobId{"j15"})) << "it was used lately";
  ThumbnailStore memory("", {}, {.memory_bytes = 300, .files = 5, .file_bytes = 1000});
  for (int i = 0; i < 20; ++i) memory.put(JobId{"j" + std::to_string(i)}, "1-1", picture('a'));
  EXPECT_FALSE(memory.find(JobId{"j16"}));
  EXPECT_TRUE(memory.find(JobId{"j17"}));
}

TEST_F(ThumbnailStoreTest, AFolderThatCanNotBeWrittenIsToldOnce) {
  std::ofstream(folder.file("file")) << "no folder";
  std::vector<std::string> lines;
  ThumbnailStore store(folder.file("file"), [&](const std::string& line) { lines.push_back(line); }, {});
  for (int i = 0; i < 3; ++i) store.put(JobId{"j1"}, std::to_string(i), picture('a'));
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], ::testing::HasSubstr("thumbnails stay in memory only"));
  EXPECT_EQ(store.find(JobId{"j1"}).value().mark, "2");
}

class ThumbnailsTest : public WebApiTest {
 protected:
  JobId rendered() {
    const JobId job = farm.submit(small_job(256, 128, 4, Integrator::kPt));
    work(farm, farm.register_worker(registration()));
    return job;
  }
  /// Asks until there is one; the thread that makes it takes its time.
  httplib::Result ask(const JobId& job, const httplib::Headers& headers = {}) {
    for (;;) {
      auto answer = http.Get("/api/v1/jobs/" + job.value + "/thumbnail", headers);
      if (!answer || answer->status != 204) return answer;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
};

TEST_F(ThumbnailsTest, AreSmallPicturesThatABrowserKeeps) {
  const JobId empty = farm.submit(small_job(64, 64, 4, Integrator::kPt));
  EXPECT_EQ(http.Get("/api/v1/jobs/" + empty.value + "/thumbnail")->status, 204);
  farm.cancel(empty);
  const JobId job = rendered();
  const auto first = ask(job);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->status, 200) << first->body;
  EXPECT_EQ(first->get_header_value("Content-Type"), "image/png");
  EXPECT_THAT(first->body, StartsWith(kPngMagic));
  EXPECT_EQ(first->body.substr(16, 8), std::string("\0\0\0\x56\0\0\0\x2b", 8)) << "86 x 43: blocks of three";
  EXPECT_FALSE(first->has_header("X-Lightmill-Stale"));
  const auto again = ask(job, {{"If-None-Match", first->get_header_value("ETag")}});
  EXPECT_EQ(again->status, 304);
  get("/api/v1/jobs/j404/thumbnail", 404);
}

TEST_F(ThumbnailsTest, OfAJobThatEndsAreMadeUnasked) {
  TemporaryFolder other;
  const Thumbnails thumbnails(farm, other.file("made"), {});
  rendered();
  while (!std::filesystem::exists(other.file("made")) || files_in(other.file("made")) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

TEST_F(ThumbnailsTest, SurviveARestartWithoutAFilm) {
  TemporaryFolder other;
  const JobId job = rendered();
  const auto wait = [&](Thumbnails& thumbnails) {
    for (;;) {
      if (auto found = thumbnails.get(job)) return *found;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  };
  std::string mark;
  {
    Thumbnails thumbnails(farm, other.path(), {});
    mark = wait(thumbnails).thumbnail.mark;
  }
  Thumbnails thumbnails(farm, other.path(), {});
  const auto found = thumbnails.get(job);
  ASSERT_TRUE(found) << "at once";
  EXPECT_TRUE(found->current);
  EXPECT_EQ(found->thumbnail.mark, mark);
  farm.extend(job, 8, {}, {});
  work(farm, farm.register_worker(registration()));
  EXPECT_TRUE(thumbnails.get(job)) << "shown until there is a newer one";
  while (!thumbnails.get(job)->current) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

}  // namespace
}  // namespace lightmill
