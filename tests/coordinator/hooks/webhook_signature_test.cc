#include "coordinator/hooks/webhook_signature.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "common/base/error.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

TEST(WebhookSignature, IsThatOfTheSpecification) {
  const WebhookSecret secret("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
  EXPECT_EQ(secret.sign("msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, R"({"test": 2432232314})"),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(WebhookSignature, OtherTextsAreNoSecrets) {
  for (const char* text :
       {"", "whsec_", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2Lb",
        "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaS", "whsec_!!!!9r8GKYqrTwjUPD8ILPZIo2LaLaSw"})
    EXPECT_THROW(WebhookSecret{text}, Error) << text;
}

TEST(WebhookSignature, AFileIsMadeOnceForThisUserAlone) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("secret");
  const std::string first = webhook_secret_of(path).sign("a", 1, "b");
  EXPECT_EQ(webhook_secret_of(path).sign("a", 1, "b"), first);
  struct stat status {};
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  EXPECT_NE(webhook_secret_of(folder.file("other")).sign("a", 1, "b"), first);
  std::ofstream(path) << "guess me";
  EXPECT_THROW(webhook_secret_of(path), Error);
  EXPECT_THROW(webhook_secret_of(folder.file("no/folder")), Error);
}

}  // namespace
}  // namespace lightmill
