// What commands and URLs are told, and how each may fail.
#include "coordinator/hooks/hook.h"

#include <gmock/gmock.h>
#include <httplib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "common/base/error.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

const WebhookSecret& test_secret() {
  static const WebhookSecret secret("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
  return secret;
}

const HookMessage kMessage{"j7.1", "job.done", "j7", R"({"type":"job.done"})"};

std::string refusal(Hook& hook) {
  try {
    hook.tell(kMessage);
  } catch (const Error& e) {
    return e.what();
  }
  return "taken";
}

std::string text_of(const std::string& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(CommandHook, GetsTheMessageOnItsInput) {
  const test::TemporaryFolder folder;
  const std::string out = folder.file("out");
  const auto hook = make_hook(
      "cat > '" + out + "'; echo \" $LIGHTMILL_EVENT $LIGHTMILL_ID\" >> '" + out + "'", test_secret());
  EXPECT_EQ(refusal(*hook), "taken");
  EXPECT_EQ(text_of(out), kMessage.body + " job.done j7\n");
}

TEST(CommandHook, IsRefusedWithItsLastLine) {
  EXPECT_EQ(refusal(*make_hook("echo first; echo no mail today >&2; exit 3", test_secret())),
            "it ended with status 3: no mail today");
  EXPECT_EQ(refusal(*make_hook("kill -9 $$", test_secret())), "it was ended by signal 9");
  EXPECT_THAT(refusal(*make_hook("/no/such/program", test_secret())), HasSubstr("status 127"));
}

TEST(CommandHook, SaysMuchAndLeavesProcessesBehind) {
  EXPECT_EQ(refusal(*make_hook("head -c 1000000 /dev/zero", test_secret())), "taken");
  // Who reads nothing of its input, and leaves the pipe open, does not matter.
  const test::TemporaryFolder folder;
  const std::string left = folder.file("pid");
  EXPECT_EQ(refusal(*make_hook("sleep 1000 & echo $! > '" + left + "'", test_secret())), "taken");
  const pid_t pid = std::stoi(text_of(left));
  EXPECT_EQ(kill(pid, 0), 0) << "it may go on after the hook";
  kill(pid, SIGKILL);
}

TEST(CommandHook, StopsWithItsChildren) {
  const test::TemporaryFolder folder;
  const std::string fifo = folder.file("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const auto hook = make_hook("(echo started > '" + fifo + "'; sleep 1000); true", test_secret());
  std::string why;
  std::thread call([&] { why = refusal(*hook); });
  EXPECT_EQ(text_of(fifo), "started\n");
  hook->stop();
  call.join();
  EXPECT_EQ(why, "it was ended by signal 9");
  EXPECT_EQ(refusal(*hook), "it was ended by signal 9") << "nor later";
}

class UrlHookTest : public ::testing::Test {
 protected:
  UrlHookTest() {
    server.Post("/hook", [this](const httplib::Request& request, httplib::Response&) { got = request; });
    server.Post("/busy", [](const httplib::Request&, httplib::Response& response) { response.status = 503; });
    server.Post("/moved",
                [](const httplib::Request&, httplib::Response& response) { response.set_redirect("/hook"); });
    server.Post("/long", [](const httplib::Request&, httplib::Response& response) {
      response.set_chunked_content_provider("text/plain", [](size_t, httplib::DataSink& sink) {
        return sink.write(std::string(65536, 'x').data(), 65536);
      });
    });
    port = server.bind_to_any_port("127.0.0.1");
    thread = std::thread([this] { server.listen_after_bind(); });
    while (!server.is_running()) std::this_thread::yield();
  }
  ~UrlHookTest() override {
    server.stop();
    thread.join();
  }
  std::string url(const std::string& path) const { return "http://127.0.0.1:" + std::to_string(port) + path; }
  httplib::Server server;
  httplib::Request got;
  int port = 0;
  std::thread thread;
};

TEST_F(UrlHookTest, PostsASignedMessage) {
  const auto hook = make_hook(url("/hook?farm=1"), test_secret());
  ASSERT_EQ(refusal(*hook), "taken");
  EXPECT_EQ(got.body, kMessage.body);
  EXPECT_EQ(got.get_param_value("farm"), "1");
  EXPECT_EQ(got.get_header_value("Content-Type"), "application/json");
  EXPECT_EQ(got.get_header_value("webhook-id"), "j7.1");
  const int64_t time = std::stoll(got.get_header_value("webhook-timestamp"));
  EXPECT_EQ(got.get_header_value("webhook-signature"), test_secret().sign("j7.1", time, kMessage.body));
}

TEST_F(UrlHookTest, SaysWhyItWasNotTaken) {
  EXPECT_EQ(refusal(*make_hook(url("/busy"), test_secret())), "it answered 503");
  EXPECT_EQ(refusal(*make_hook(url("/moved"), test_secret())), "it answered 302")
      << "nobody is led elsewhere";
  EXPECT_THAT(refusal(*make_hook(url("/long"), test_secret())), HasSubstr("can't be reached"));
  EXPECT_THAT(refusal(*make_hook("http://127.0.0.1:1/", test_secret())), HasSubstr("can't be reached"));
  const auto stopped = make_hook(url("/hook"), test_secret());
  stopped->stop();
  EXPECT_THAT(refusal(*stopped), HasSubstr("shutting down"));
}

TEST(MakeHook, RefusesWhatCanNotBeCalled) {
  for (const char* what : {"", "  ", "http://", "https:///path", "http://a b/", "http://user:word@host/"})
    EXPECT_THROW(make_hook(what, test_secret()), Error) << what;
}

}  // namespace
}  // namespace lightmill
