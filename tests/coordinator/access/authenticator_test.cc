#include "coordinator/access/authenticator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "tests/support/base64.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using Kind = Verdict::Kind;

constexpr int64_t kNow = 1'900'000'000;
constexpr const char* kGetJob = "/lightmill.v1.ClientService/GetJob";
constexpr const char* kSubmit = "/lightmill.v1.ClientService/SubmitJob";

class AuthenticatorTest : public ::testing::Test {
 protected:
  void write(const std::string& text) { std::ofstream(path) << text; }
  static std::string line(const std::string& name, Role role, const std::string& token,
                          std::optional<int64_t> expires = std::nullopt) {
    return token_line({name, role, expires, sha256_hex(token)});
  }
  test::TemporaryFolder folder;
  const std::string path = folder.file("tokens");
  std::string logged;
  const Authenticator::Log log = [this](const std::string& text) { logged += text + "\n"; };
};

TEST_F(AuthenticatorTest, JudgesByTokenExpiryAndRole) {
  write("# a comment\n\n" + line("ann", Role::kSubmitter, "s3cret") +
        line("obi", Role::kObserver, "look", kNow));
  Authenticator a(path, log);
  const Verdict good = a.judge(kSubmit, "Bearer s3cret", kNow);
  EXPECT_EQ(good.kind, Kind::kAllowed);
  EXPECT_EQ(good.name, "ann");
  for (const char* header : {"", "Bearer", "Bearer ", "s3cret", "bearer", "Digest s3cret", "Bearer s3cre",
                             "Bearer s3cret ", "Bearer s3crets", "Basic", "Basic ****", "Basic YQ=="}) {
    EXPECT_EQ(a.judge(kSubmit, header, kNow).kind, Kind::kUnauthenticated) << header;
  }
  EXPECT_EQ(a.judge(kSubmit, "Bearer " + sha256_hex("s3cret"), kNow).kind, Kind::kUnauthenticated)
      << "who reads the table must not get in";
  EXPECT_EQ(a.judge(kSubmit, "Bearer look", kNow - 1).kind, Kind::kForbidden);
  EXPECT_THAT(a.judge(kSubmit, "Bearer look", kNow - 1).message, HasSubstr("this needs submitter or admin"));
  EXPECT_EQ(a.judge(kGetJob, "Bearer look", kNow - 1).kind, Kind::kAllowed);
  EXPECT_EQ(a.judge(kGetJob, "Bearer look", kNow).kind, Kind::kUnauthenticated);
  EXPECT_THAT(a.judge(kGetJob, "Bearer look", kNow).message, HasSubstr("expired on " + utc_text(kNow)));
  EXPECT_EQ(a.judge("/lightmill.v1.ClientService/New", "Bearer s3cret", kNow).kind, Kind::kForbidden);
  EXPECT_EQ(a.judge("", "", kNow).kind, Kind::kUnauthenticated);
  EXPECT_EQ(a.judge("/healthz", "", kNow).kind, Kind::kAllowed);
}

TEST_F(AuthenticatorTest, BrowsersSendItAsAPassword) {
  write(line("ann", Role::kObserver, "s3cret"));
  Authenticator a(path, log);
  EXPECT_EQ(a.judge("/", "Basic " + test::base64("anybody:s3cret"), kNow).kind, Kind::kAllowed);
  EXPECT_EQ(a.judge("/", "Basic " + test::base64(":s3cret"), kNow).kind, Kind::kAllowed);
  EXPECT_EQ(a.judge("/", "Basic " + test::base64("s3cret:"), kNow).kind, Kind::kUnauthenticated);
  EXPECT_EQ(a.judge("/", "Basic " + std::string(1 << 20, 'A'), kNow).kind, Kind::kUnauthenticated);
}

TEST_F(AuthenticatorTest, TokensRotateWithoutARestart) {
  write(line("ann", Role::kAdmin, "old"));
  Authenticator a(path, log);
  write(line("ann", Role::kAdmin, "old") + line("ann", Role::kAdmin, "newer"));
  EXPECT_EQ(a.judge(kGetJob, "Bearer old", kNow).kind, Kind::kAllowed);
  EXPECT_EQ(a.judge(kGetJob, "Bearer newer", kNow).kind, Kind::kAllowed);
  write(line("ann", Role::kAdmin, "newer"));
  EXPECT_EQ(a.judge(kGetJob, "Bearer old", kNow).kind, Kind::kUnauthenticated);
  logged.clear();
  write("nonsense\n");
  EXPECT_EQ(a.judge(kGetJob, "Bearer newer", kNow).kind, Kind::kAllowed) << "the last good table stays";
  EXPECT_THAT(logged, HasSubstr(path + ":1: expected NAME ROLE EXPIRES HASH"));
}

TEST(TokenTable, NamesTheLine) {
  const std::string hash(64, 'a');
  const TokenTable table =
      parse_tokens("ann admin never " + hash + "\nbob worker 2030-03-17T17:46:40Z " + hash, "f");
  ASSERT_EQ(table.size(), 2u);
  EXPECT_EQ(table[1].expires, kNow);
  EXPECT_EQ(token_line(table[1]), "bob worker 2030-03-17T17:46:40Z " + hash + "\n");
  for (const std::string& bad : std::initializer_list<std::string>{
           "ann", "ann admin never", "ann root never " + hash, "ann admin soon " + hash,
           "ann admin never " + hash + " x", "ann admin never " + hash.substr(1),
           "ann admin never " + std::string(64, 'A'), "a/b admin never " + hash,
           std::string(65, 'a') + " admin never " + hash, "ann admin 2030-13-17T00:00:00Z " + hash}) {
    try {
      parse_tokens("# fine\n" + bad, "file");
      ADD_FAILURE() << bad;
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr("file:2: "));
      EXPECT_EQ(e.exit_code(), 2);
    }
  }
  EXPECT_THROW(read_tokens("/nonexistent/tokens"), Error);
}

}  // namespace
}  // namespace lightmill
