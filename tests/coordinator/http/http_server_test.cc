// The HTTP side of a server in this process: health, metrics, and peers that take their time.
#include <gmock/gmock.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "coordinator/http/http_watch.h"
#include "tests/coordinator/service/service_fixture.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

class HttpServerTest : public testing::ServiceTest {};

TEST_F(HttpServerTest, ServesHealthAndMetrics) {
  submit(4);
  submit(4);
  httplib::Client http("127.0.0.1", server->http_port());
  auto health = http.Get("/healthz");
  ASSERT_TRUE(health);
  EXPECT_EQ(health->status, 200);
  auto metrics = http.Get("/metrics");
  ASSERT_TRUE(metrics);
  EXPECT_THAT(metrics->body, HasSubstr("lightmill_jobs{state=\"queued\"} 2\n"));
  EXPECT_THAT(metrics->body, HasSubstr("# TYPE lightmill_commits_total counter"));
  EXPECT_THAT(metrics->body, HasSubstr("\nlightmill_coordinator_leading 1\n"));
  EXPECT_EQ(http.Get("/nothing")->status, 404);
}

int connect_to(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

/// The first line of the answer to a request that is sent as it is.
std::string first_line(int port, std::string_view request) {
  const int fd = connect_to(port);
  EXPECT_EQ(::send(fd, request.data(), request.size(), MSG_NOSIGNAL), static_cast<ssize_t>(request.size()));
  std::string line;
  for (char c; recv(fd, &c, 1, 0) == 1 && c != '\r';) line += c;
  close(fd);
  return line;
}

TEST_F(HttpServerTest, BodiesSayHowLongTheyAre) {
  EXPECT_THAT(first_line(server->http_port(), "POST /api/v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\nx"),
              HasSubstr(" 411 "));
  // A length that something else contradicts is none.
  for (const char* path : {"/api/v1/jobs/j1/pause", "/v1/jobs/j1:pause"}) {
    for (const char* method : {"POST ", "PUT ", "PATCH ", "DELETE "}) {
      EXPECT_THAT(first_line(server->http_port(), std::string(method) + path +
                                                      " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n"
                                                      "Transfer-Encoding: chunked\r\n\r\n"),
                  HasSubstr(" 411 "))
          << method << path;
    }
  }
}

TEST_F(HttpServerTest, RangesComeOneAtATime) {
  const std::string head = "GET /livez HTTP/1.1\r\nHost: localhost\r\nRange: bytes=";
  EXPECT_THAT(first_line(server->http_port(), head + "0-1,0-1,0-1\r\n\r\n"), HasSubstr(" 416 "));
  EXPECT_THAT(first_line(server->http_port(), head + "0-1\r\n\r\n"), HasSubstr(" 206 "));
}

/// A connection that brings a request a byte at a time.
class Trickle {
 public:
  explicit Trickle(int port) : fd_(connect_to(port)) {
    for (const char c : std::string_view("GET /livez HTTP/1.1\r\nX: ")) send(c);
  }
  ~Trickle() { close(fd_); }
  Trickle(const Trickle&) = delete;
  Trickle& operator=(const Trickle&) = delete;
  /// False once it was cut off.
  bool send(char c) const { return ::send(fd_, &c, 1, MSG_NOSIGNAL) == 1; }

 private:
  int fd_;
};

TEST_F(HttpServerTest, PeersThatTrickleHoldNoThreads) {
  std::vector<std::unique_ptr<Trickle>> crowd;  // more than there are threads
  for (int i = 0; i < 150; ++i) crowd.push_back(std::make_unique<Trickle>(server->http_port()));
  std::atomic<int> cut = 0;
  std::jthread trickling([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      int gone = 0;
      for (const auto& peer : crowd) gone += !peer->send('x');
      cut = gone;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  });
  httplib::Client http("127.0.0.1", server->http_port());
  http.set_read_timeout(60);
  // On a busy machine a probe may be among the silent ones while there is such a crowd: they ask again.
  auto live = http.Get("/livez");
  for (int i = 0; i < 60 && !live; ++i) live = http.Get("/livez");
  ASSERT_TRUE(live) << "no thread is left";
  EXPECT_EQ(live->status, 200);
  for (int i = 0; i < 600 && cut < 150 - static_cast<int>(HttpWatch::kMostSilent); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_GE(cut, 150 - static_cast<int>(HttpWatch::kMostSilent));
}

}  // namespace
}  // namespace lightmill
