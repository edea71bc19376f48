#include "worker/agent/blob_giver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/digest.h"
#include "tests/worker/agent/fake_farm.h"
#include "tests/worker/agent/temporary_folder.h"
#include "worker/agent/blob_cache.h"

namespace lightmill::agent {
namespace {

using ::testing::ElementsAre;
using testing::FakeFarm;
using testing::FixedSource;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class BlobGiverTest : public ::testing::Test {
 protected:
  std::string put(const std::string& content, const std::string& path) {
    std::ofstream(path, std::ios::trunc) << content;
    source.files[sha256_hex(content)] = path;
    return sha256_hex(content);
  }
  const testing::TemporaryFolder folder;
  FakeFarm farm;
  FixedSource source;
  std::vector<std::string> log;
  BlobGiver giver{farm, source, [this](const std::string& line) { log.push_back(line); }};
};

TEST_F(BlobGiverTest, GivesWhatIsWantedAndHereAndRight) {
  const std::string here = put("here", folder.path.string() + "/a"),
                    damaged = put("good", folder.path.string() + "/b");
  std::ofstream(folder.path.string() + "/b", std::ios::trunc) << "baad";
  put("not wanted", folder.path.string() + "/c");
  farm.wanted = {here, damaged, sha256_hex("elsewhere"), "../../etc/passwd"};
  giver.give(0);
  EXPECT_THAT(farm.handed_in, ElementsAre(here));
  EXPECT_THAT(log, ElementsAre(HasSubstr("handed in")));
}

TEST_F(BlobGiverTest, LeavesABlobAloneForAWhileAfterATry) {
  const std::string here = put("here", folder.path.string() + "/a");
  farm.wanted = {here};
  farm.down_calls = 1;
  giver.give(0);
  giver.give(BlobGiver::kPauseSeconds - 1);
  EXPECT_THAT(farm.handed_in, IsEmpty());
  EXPECT_THAT(log, ElementsAre(HasSubstr("can't be handed in: no route")));
  giver.give(BlobGiver::kPauseSeconds);
  EXPECT_THAT(farm.handed_in, ElementsAre(here));
}

TEST_F(BlobGiverTest, ACacheFindsABlobWhateverItsExtension) {
  const BlobCache cache(folder.path.string(), 1000);
  const std::string digest = sha256_hex("wood");
  EXPECT_EQ(cache.find(digest), "");
  std::ofstream(folder.path.string() + "/" + digest + ".png") << "wood";
  EXPECT_EQ(cache.find(digest), folder.path.string() + "/" + digest + ".png");
}

}  // namespace
}  // namespace lightmill::agent
