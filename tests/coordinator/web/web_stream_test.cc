// The dashboard's stream of changes over real HTTP.
#include <sys/socket.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "coordinator/web/web_api.h"
#include "tests/coordinator/web/web_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using nlohmann::json;

/// Reads Server-Sent Events in a thread of its own.
class EventReader {
 public:
  struct Event {
    std::string name, id;
    json data;
  };
  EventReader(int port, const std::string& path, const httplib::Headers& headers = {})
      : client_("127.0.0.1", port) {
    client_.set_read_timeout(30);
    thread_ = std::thread([this, path, headers] {
      const auto result = client_.Get(
          path, headers,
          [this](const httplib::Response& response) {
            const std::lock_guard lock(mutex_);
            status_ = response.status;
            changed_.notify_all();
            return true;
          },
          [this](const char* data, size_t size) {
            return take({data, size});
          });
      const std::lock_guard lock(mutex_);
      if (result && status_ == 0) status_ = result->status;
      ended_ = true;
      changed_.notify_all();
    });
  }
  ~EventReader() {
    {
      const std::lock_guard lock(mutex_);
      leave_ = true;
    }
    client_.stop();
    thread_.join();
  }
  /// The first event, of those not yet asked for, that `wanted` takes; fails the test after a long wait.
  Event until(const std::function<bool(const Event&)>& wanted) {
    std::unique_lock lock(mutex_);
    for (;;) {
      for (; next_ < events_.size(); ++next_) {
        if (wanted(events_[next_])) return events_[next_++];
      }
      if (ended_ || changed_.wait_for(lock, std::chrono::seconds(60)) == std::cv_status::timeout) break;
    }
    ADD_FAILURE() << "the stream did not bring what the test waits for";
    return {"", "", json::object()};
  }
  Event named(const std::string& name) {
    return until([&](const Event& event) { return event.name == name; });
  }
  int status() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return status_ != 0 || ended_; });
    return status_;
  }
  bool ended() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), [&] { return ended_; });
  }

 private:
  bool take(std::string_view bytes) {
    const std::lock_guard lock(mutex_);
    text_ += bytes;
    for (size_t end; (end = text_.find("\n\n")) != std::string::npos; text_.erase(0, end + 2)) {
      Event event;
      std::istringstream lines(text_.substr(0, end));
      for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("event: ")) event.name = line.substr(7);
        if (line.starts_with("id: ")) event.id = line.substr(4);
        if (line.starts_with("data: ")) event.data = json::parse(line.substr(6));
      }
      events_.push_back(std::move(event));
    }
    changed_.notify_all();
    return !leave_;
  }
  httplib::Client client_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string text_;
  std::vector<Event> events_;
  size_t next_ = 0;
  int status_ = 0;
  bool leave_ = false, ended_ = false;
  std::thread thread_;
};

using WebStreamTest = WebApiTest;

bool has_row(const EventReader::Event& event, const std::string& id, const std::string& state) {
  if (event.name != "jobs") return false;
  for (const json& row : event.data["rows"]) {
    if (row["id"] == id && row["state"] == state) return true;
  }
  return false;
}

TEST_F(WebStreamTest, FramesOfSequencesComeOnlyWhereOneIsFollowed) {
  farm.submit(SequenceRequest{}, {{7, fake_bundle(), small_settings(64, 64, 20)}});
  const JobId single = farm.submit(small_job(64, 64, 20));
  EventReader reader(server->http_port(), "/api/v1/events?job=s1.7");
  const auto all = reader.named("jobs");
  ASSERT_EQ(all.data["rows"].size(), 1u);
  EXPECT_EQ(all.data["rows"][0]["id"], single.value);
  EXPECT_EQ(reader.named("job").data["row"]["id"], "s1.7");
  EventReader other(server->http_port(), "/api/v1/events?job=" + single.value);
  EXPECT_FALSE(other.named("job").data.contains("row"));
}

TEST_F(WebStreamTest, TheStreamBringsWhatChangedAndNoMore) {
  const JobId first = farm.submit(small_job(64, 64, 20)), second = farm.submit(small_job(64, 64, 20));
  std::string cursor;
  {
    EventReader reader(server->http_port(), "/api/v1/events");
    EXPECT_EQ(reader.named("hello").data["may_act"], true);
    const auto all = reader.named("jobs");
    EXPECT_EQ(all.data["full"], true);
    EXPECT_EQ(all.data["rows"].size(), 2u);
    EXPECT_EQ(reader.named("workers").data, json({{"full", true}, {"rows", json::array()}}));
    farm.pause(second);
    const auto delta = reader.named("jobs");
    EXPECT_EQ(delta.data["full"], false);
    ASSERT_EQ(delta.data["rows"].size(), 1u);
    EXPECT_EQ(delta.data["rows"][0]["id"], second.value);
    EXPECT_EQ(delta.data["rows"][0]["state"], "paused");
    events.add("job j1: something");
    const auto log = reader.named("log");
    EXPECT_EQ(log.data[0]["text"], "job j1: something");
    cursor = log.id;
  }
  farm.pause(first);  // while nobody listens
  const WorkerId worker = farm.register_worker(registration());
  {
    EventReader reader(server->http_port(), "/api/v1/events", {{"Last-Event-ID", cursor}});
    const auto delta = reader.named("jobs");
    EXPECT_EQ(delta.data["full"], false);
    ASSERT_EQ(delta.data["rows"].size(), 1u);
    EXPECT_EQ(delta.data["rows"][0]["id"], first.value);
    EXPECT_EQ(reader.named("workers").data["rows"][0]["id"], worker.value);
  }
  // Another coordinator's cursor, or nonsense: everything anew.
  for (const char* other : {"0123456789abcdef-7-7", "x", "--", ""}) {
    EventReader reader(server->http_port(), "/api/v1/events?since=" + std::string(other));
    EXPECT_EQ(reader.named("jobs").data["full"], true) << other;
  }
}

TEST_F(WebStreamTest, AJobIsFollowedToItsEnd) {
  const JobId id = farm.submit(small_job(96, 64, 64, Integrator::kPt));
  EventReader reader(server->http_port(), "/api/v1/events?job=" + id.value);
  const auto begin = reader.named("job");
  EXPECT_EQ(begin.data["full"], true);
  EXPECT_EQ(begin.data["detail"]["settings"]["spp"], 64);
  const WorkerId worker = farm.register_worker(registration());
  const LeaseGrant held = farm.lease(worker).value();
  const auto leased =
      reader.until([](const auto& event) { return event.name == "job" && event.data.contains("tiles"); });
  EXPECT_FALSE(leased.data.contains("detail"));
  EXPECT_EQ(leased.data["tiles"][0]["state"], "leased");
  ASSERT_EQ(farm.commit(worker, {held.job, held.tile_id, held.attempt}, fake_bytes(held)),
            CommitResult::kAccepted);
  work(farm, worker);
  size_t points = 0;
  int64_t complete = 0;
  while (complete < 64) {
    const auto event = reader.named("job");
    if (event.name.empty()) break;
    if (event.data.contains("points")) points += event.data["points"].size();
    complete = event.data["complete_samples"];
  }
  EXPECT_EQ(points, farm.curve(id).points.size());
  EventReader lost(server->http_port(), "/api/v1/events?job=j404");
  EXPECT_EQ(lost.named("job").data["missing"], true);
}

TEST_F(WebStreamTest, WhoDoesNotReadHindersNobody) {
  // Many jobs with long names: far more than the buffers of a connection hold.
  JobRequest request = small_job(64, 64, 4);
  request.name = std::string(1000, 'n');
  for (int i = 0; i < 8000; ++i) farm.submit(request);
  const JobId last = farm.submit(request);
  httplib::Client stalled("127.0.0.1", server->http_port());
  std::mutex mutex;
  std::condition_variable stuck, go_on;
  bool is_stuck = false, over = false;
  std::thread sleeper([&] {
    stalled.Get("/api/v1/events", [&](const char*, size_t) {
      std::unique_lock lock(mutex);
      is_stuck = true;
      stuck.notify_all();
      go_on.wait(lock, [&] { return over; });
      return false;
    });
  });
  {
    std::unique_lock lock(mutex);
    ASSERT_TRUE(stuck.wait_for(lock, std::chrono::seconds(60), [&] { return is_stuck; }));
  }
  // Another browser sees a change, and a worker gets on.
  EventReader reader(server->http_port(), "/api/v1/events");
  farm.cancel(last);
  reader.until([&](const auto& event) { return has_row(event, last.value, "cancelled"); });
  const WorkerId worker = farm.register_worker(registration());
  EXPECT_GT(work(farm, worker, 5), 0);
  {
    const std::lock_guard lock(mutex);
    over = true;
    go_on.notify_all();
  }
  sleeper.join();
}

TEST_F(WebStreamTest, StreamsEndWithTheServer) {
  EventReader reader(server->http_port(), "/api/v1/events");
  reader.named("hello");
  server.reset();
  EXPECT_TRUE(reader.ended());
}

TEST_F(WebStreamTest, TheNumberOfStreamsIsBounded) {
  std::vector<std::unique_ptr<EventReader>> readers;
  for (int i = 0; i < WebApi::kMaxStreams; ++i) {
    readers.push_back(std::make_unique<EventReader>(server->http_port(), "/api/v1/events"));
    readers.back()->named("hello");
  }
  EventReader late(server->http_port(), "/api/v1/events");
  late.named("hello");
  EXPECT_TRUE(readers.front()->ended()) << "the oldest makes room";
  EXPECT_EQ(http.Get("/healthz")->status, 200);
}

}  // namespace
}  // namespace lightmill
