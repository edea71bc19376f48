#include "coordinator/access/credential_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/error.h"
#include "common/rpc/certificate_text.h"
#include "common/rpc/security.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using namespace testing;
namespace fs = std::filesystem;

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

Certificate certificate_of(const std::string& path) {
  FILE* const file = std::fopen(path.c_str(), "r");
  Certificate certificate(file ? PEM_read_X509(file, nullptr, nullptr, nullptr) : nullptr, X509_free);
  if (file) std::fclose(file);
  return certificate;
}

class CredentialFolderTest : public ::testing::Test {
 protected:
  test::TemporaryFolder temporary;
  const std::string root = temporary.file("credentials");
  const int64_t now = std::time(nullptr);
  CredentialFolder folder{root, now};
};

TEST_F(CredentialFolderTest, MakesWhatIsMissingForItsOwnerAlone) {
  EXPECT_EQ(folder.init({"farm.example.org", "10.1.2.3"}, 30, false).size(), 3u);
  folder.grant("gpu-box", Role::kWorker, 30, std::nullopt, 0);
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    struct stat s {};
    ASSERT_EQ(stat(entry.path().c_str(), &s), 0);
    EXPECT_EQ(s.st_mode & 0777, entry.is_directory() ? 0700u : 0600u) << entry.path();
    files += entry.is_regular_file();
  }
  EXPECT_EQ(files, 10u);
  EXPECT_NO_THROW(resolve({.folder = root + "/coordinator"}, Side::kServer));
  EXPECT_NO_THROW(resolve({.folder = root + "/gpu-box"}, Side::kClient));
  const std::string names = names_of(certificate_of(root + "/coordinator/tls.crt"));
  for (const char* name : {"farm.example.org", "10.1.2.3", "localhost", "127.0.0.1", "::1"})
    EXPECT_THAT(names, HasSubstr(name));
  const TokenTable table = read_tokens(root + "/coordinator/tokens");
  ASSERT_EQ(table.size(), 1u);
  EXPECT_EQ(table[0].role, Role::kWorker);
  const std::string token = read_token(root + "/gpu-box/token");
  EXPECT_EQ(find_token(table, token), &table[0]);
  EXPECT_THAT(text_of(root + "/coordinator/tokens"), Not(HasSubstr(token)));

  const std::string certificate = text_of(root + "/coordinator/tls.crt");
  EXPECT_TRUE(folder.init({}, 30, false).empty());
  EXPECT_EQ(text_of(root + "/coordinator/tls.crt"), certificate);
}

TEST_F(CredentialFolderTest, RenewsFromTheSameAuthority) {
  folder.init({"farm.example.org"}, 30, false);
  folder.grant("ann", Role::kSubmitter, 30, std::nullopt, 0);
  const std::string authority = text_of(root + "/ca/ca.crt"), token = read_token(root + "/ann/token");
  const std::string server = text_of(root + "/coordinator/tls.crt"), client = text_of(root + "/ann/tls.crt");
  folder.init({"new.example.org"}, 30, true);
  EXPECT_EQ(text_of(root + "/ca/ca.crt"), authority);
  EXPECT_EQ(read_token(root + "/ann/token"), token);
  EXPECT_NE(text_of(root + "/coordinator/tls.crt"), server);
  EXPECT_NE(text_of(root + "/ann/tls.crt"), client);
  EXPECT_THAT(names_of(certificate_of(root + "/coordinator/tls.crt")),
              AllOf(HasSubstr("farm.example.org"), HasSubstr("new.example.org")));
}

TEST_F(CredentialFolderTest, ANewTokenLeavesTheOldOneAWhile) {
  folder.init({}, 30, false);
  folder.grant("ann", Role::kSubmitter, 30, std::nullopt, 0);
  const std::string old = read_token(root + "/ann/token");
  folder.grant("ann", Role::kSubmitter, 30, 7, 24);
  const TokenTable table = read_tokens(root + "/coordinator/tokens");
  ASSERT_EQ(table.size(), 2u);
  EXPECT_EQ(find_token(table, old)->expires, now + 24 * 3600);
  EXPECT_EQ(find_token(table, read_token(root + "/ann/token"))->expires, now + 7 * 24 * 3600);
  folder.revoke("ann");
  EXPECT_TRUE(read_tokens(root + "/coordinator/tokens").empty());
  EXPECT_FALSE(fs::exists(root + "/ann"));
  EXPECT_THROW(folder.revoke("ann"), Error);
}

TEST_F(CredentialFolderTest, RefusesNamesThatLeadElsewhere) {
  EXPECT_THROW(folder.grant("ann", Role::kAdmin, 30, std::nullopt, 0), Error) << "without init";
  folder.init({}, 30, false);
  for (const char* name : {"", "..", ".", "a/b", "../x", "ca", "coordinator", "a b", "a\nb", "#"}) {
    EXPECT_THROW(folder.grant(name, Role::kAdmin, 30, std::nullopt, 0), Error) << name;
    EXPECT_THROW(folder.revoke(name), Error) << name;
  }
  EXPECT_TRUE(read_tokens(root + "/coordinator/tokens").empty());
  for (const char* host : {"", "a b", "x,DNS:evil", "http://x"})
    EXPECT_THROW(folder.init({host}, 30, true), Error) << host;
}

TEST_F(CredentialFolderTest, ResolveNamesWhatIsWrong) {
  folder.init({}, 30, false);
  folder.grant("ann", Role::kAdmin, 30, std::nullopt, 0);
  const std::string ann = root + "/ann";
  const auto message = [](const SecurityFiles& files, int exit_code) {
    try {
      resolve(files, Side::kClient);
      return std::string("accepted");
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), exit_code) << e.what();
      return std::string(e.what());
    }
  };
  EXPECT_EQ(message({}, 0), "accepted");
  EXPECT_THAT(message({.token = ann + "/token"}, 2), HasSubstr("--token-file without --tls-"));
  EXPECT_THAT(message({.ca = ann + "/ca.crt", .cert = ann + "/tls.crt"}, 2), HasSubstr("--tls-key"));
  EXPECT_THAT(message({.folder = "/nonexistent"}, 2),
              HasSubstr("--tls-ca /nonexistent/ca.crt: can't be read"));
  EXPECT_THAT(message({.folder = ann, .key = root + "/ca/ca.key"}, 2), HasSubstr("is not the key of"));
  EXPECT_THAT(message({.folder = ann, .cert = ann + "/token"}, 2), HasSubstr("holds no certificate"));
  EXPECT_THAT(message({.folder = ann, .token = ann + "/tls.key"}, 2), HasSubstr("holds no token"));
  const auto issue = [&](const std::string& name, const Validity& validity) {
    const CertificateAuthority ca({text_of(root + "/ca/ca.crt"), text_of(root + "/ca/ca.key")});
    const PemPair pair = ca.issue(name, {}, validity);
    std::ofstream(temporary.file(name + ".crt")) << pair.certificate;
    std::ofstream(temporary.file(name + ".key")) << pair.key;
    return SecurityFiles{
        .folder = ann, .cert = temporary.file(name + ".crt"), .key = temporary.file(name + ".key")};
  };
  EXPECT_THAT(message(issue("old", {now - 100, now - 50}), 3), HasSubstr("old.crt expired on "));
  EXPECT_THAT(message(issue("early", {now + 5000, now + 9000}), 3),
              AllOf(HasSubstr("early.crt is valid only from "), HasSubstr("this machine's clock says")));
}

}  // namespace
}  // namespace lightmill
