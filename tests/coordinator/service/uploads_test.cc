// Files that come in pieces.
#include "coordinator/service/scenes/uploads.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/base/digest.h"
#include "coordinator/core/farm.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

class UploadsTest : public ::testing::Test {
 protected:
  UploadsTest() : blobs(folder.file("blobs")), uploads(blobs, 1000) {}
  size_t files() const {
    size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("blobs")))
      count += entry.is_regular_file();
    return count;
  }
  test::TemporaryFolder folder;
  BlobStore blobs;
  Uploads uploads;
};

TEST_F(UploadsTest, PiecesThatAreLostOrComeTwiceDoNoHarm) {
  const std::string text = "abcdefghij", digest = sha256_hex(text);
  EXPECT_EQ(uploads.put("a", digest, 10, 0, text.substr(0, 4), 0).received, 4u);
  EXPECT_EQ(uploads.put("a", digest, 10, 0, text.substr(0, 4), 0).received, 4u) << "again";
  EXPECT_EQ(uploads.put("a", digest, 10, 8, text.substr(8), 0).received, 4u) << "the one before was lost";
  EXPECT_EQ(uploads.put("b", digest, 10, 4, text.substr(4), 0).received, 0u)
      << "somebody else has begun nothing";
  EXPECT_FALSE(blobs.contains(digest));
  const Uploads::Progress end = uploads.put("a", digest, 10, 4, text.substr(4), 0);
  EXPECT_TRUE(end.complete);
  EXPECT_EQ(end.received, 10u);
  EXPECT_EQ(blobs.size(digest), 10u);
  EXPECT_TRUE(uploads.put("b", digest, 10, 0, "", 0).complete) << "known to all";
  EXPECT_THROW(uploads.put("b", digest, 9, 0, "", 0), Error);
  EXPECT_TRUE(uploads.put("a", sha256_hex(""), 0, 0, "", 0).complete);
}

TEST_F(UploadsTest, WhatIsNotWhatItSaysIsNotKept) {
  const std::string digest = sha256_hex("right");
  EXPECT_THROW(uploads.put("a", digest, 5, 0, "wrong", 0), Error);
  EXPECT_THROW(uploads.put("a", digest, 5, 0, "too long", 0), Error);
  uploads.put("a", digest, 5, 0, "ri", 0);
  EXPECT_THROW(uploads.put("a", digest, 6, 2, "ght", 0), Error);
  EXPECT_FALSE(blobs.contains(digest));
  EXPECT_EQ(files(), 0u);
  for (const char* name : {"", "../../etc/passwd", "ABCDEF", "%2e%2e"})
    EXPECT_THROW(uploads.put("a", name, 5, 0, "right", 0), Error) << name;
  EXPECT_EQ(files(), 0u);
  EXPECT_THROW(uploads.put("a", digest, 1001, 0, "", 0), LimitReached);
  EXPECT_TRUE(uploads.put("a", digest, 5, 0, "right", 0).complete) << "and then it comes right";
}

TEST_F(UploadsTest, WhoStopsMakesRoomForOthers) {
  std::vector<std::string> digests;
  for (size_t i = 0; i <= Uploads::kMaxOpen; ++i) digests.push_back(sha256_hex(std::to_string(i) + "!"));
  for (size_t i = 0; i < Uploads::kMaxOpen; ++i)
    uploads.put("a", digests[i], 100, 0, "x", static_cast<double>(i));
  EXPECT_EQ(files(), Uploads::kMaxOpen);
  EXPECT_THROW(uploads.put("a", digests.back(), 100, 0, "x", Uploads::kIdleSeconds - 1), LimitReached);
  EXPECT_EQ(uploads.put("a", digests[0], 100, 1, "y", Uploads::kIdleSeconds - 1).received, 2u);
  EXPECT_EQ(uploads.put("a", digests.back(), 100, 0, "x", Uploads::kIdleSeconds + 2).received, 1u);
  EXPECT_EQ(uploads.put("a", digests[0], 100, 2, "z", Uploads::kIdleSeconds + 2).received, 3u)
      << "it went on";
  EXPECT_EQ(uploads.put("a", digests[1], 100, 1, "y", Uploads::kIdleSeconds + 3).received, 0u) << "forgotten";
}

}  // namespace
}  // namespace lightmill
