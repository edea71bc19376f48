#include "coordinator/service/streams/watch_feed.h"

#include <chrono>
#include <utility>

#include "common/rpc/convert.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

constexpr std::chrono::milliseconds kSpacing(200);  // between two states of a job
constexpr double kBeatSeconds = 1;                  // a state is sent as often, changed or not

double now_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool is_last(const v1::WatchJobResponse& message) { return is_final(from_proto(message.job().state())); }

}  // namespace

/// Deletes itself once the stream has ended. Its methods want the feed's mutex held, but those of gRPC.
class WatchFeed::Watcher final : public grpc::ServerWriteReactor<v1::WatchJobResponse> {
 public:
  Watcher(WatchFeed& feed, grpc::CallbackServerContext& context, JobId job)
      : feed_(feed), job_(std::move(job)), call_(feed.stalls_, context, &feed.group_) {}

  const JobId& job() const { return job_; }
  bool admitted() const { return call_.admitted(); }
  bool wants(const v1::WatchJobResponse& message) const {
    if (writing_ || ended_) return false;
    return !last_ || last_->job().version() < message.job().version() ||
           now_seconds() - sent_at_ >= kBeatSeconds;
  }
  void send(Message message) {
    writing_ = true;
    last_ = std::move(message);
    sent_at_ = now_seconds();
    call_.begin();
    StartWrite(last_.get());
  }
  /// Once what is being written has arrived.
  void end(const grpc::Status& status) {
    if (ended_) return;
    ended_ = true;
    status_ = status;
    if (!writing_) Finish(status_);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(feed_.mutex_);
    writing_ = false;
    call_.end(ok ? last_->ByteSizeLong() : 0);
    if (ended_) {
      Finish(status_);
    } else if (!ok) {
      end(grpc::Status::CANCELLED);
    } else if (is_last(*last_)) {
      end(grpc::Status::OK);
    }
  }
  void OnCancel() override {
    const std::lock_guard lock(feed_.mutex_);
    end(grpc::Status::CANCELLED);
  }
  void OnDone() override {
    {
      const std::lock_guard lock(feed_.mutex_);
      feed_.watchers_.erase(this);
    }
    delete this;
  }

 private:
  WatchFeed& feed_;
  const JobId job_;
  StallWatch::Call call_;
  Message last_;  // sent or being sent
  double sent_at_ = 0;
  bool writing_ = false, ended_ = false;
  grpc::Status status_;
};

WatchFeed::WatchFeed(const Farm& farm, StallWatch& stalls, size_t most)
    : farm_(farm), stalls_(stalls), group_(stalls, most), thread_([this] { loop(); }) {}

WatchFeed::~WatchFeed() {
  stop();
  thread_.join();
}

void WatchFeed::stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  news_.notify_all();
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchFeed::watch(grpc::CallbackServerContext& context,
                                                                 const JobId& job) {
  // Known jobs only: nobody waits for one that may never come.
  const grpc::Status known = guarded([&] { return farm_.job(job), grpc::Status::OK; });
  auto* const watcher = new Watcher(*this, context, job);
  const std::lock_guard lock(mutex_);
  if (!known.ok()) {
    watcher->end(known);
  } else if (stopping_) {
    watcher->end({grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"});
  } else if (!watcher->admitted()) {
    watcher->end(
        {grpc::StatusCode::RESOURCE_EXHAUSTED, "too many jobs are being watched at once; try again"});
  } else {
    watchers_.insert(watcher);
    news_.notify_all();
  }
  return watcher;
}

WatchFeed::Message WatchFeed::state(const JobId& job) {
  const auto added = states_.try_emplace(job);
  Message& made = added.first->second;
  if (added.second) {
    const grpc::Status known = guarded([&] {
      auto message = std::make_shared<v1::WatchJobResponse>();
      *message->mutable_job() = to_proto(farm_.job(job));
      made = std::move(message);
      return grpc::Status::OK;
    });
    if (!known.ok()) made = nullptr;
  }
  return made;
}

void WatchFeed::look() {
  for (Watcher* watcher : std::set(watchers_)) {
    if (stopping_) {
      watcher->end({grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"});
      continue;
    }
    const Message message = state(watcher->job());
    if (message && watcher->wants(*message)) watcher->send(message);
  }
  states_.clear();
}

void WatchFeed::loop() {
  std::unique_lock lock(mutex_);
  for (;;) {
    look();
    if (stopping_) return;
    if (watchers_.empty()) {
      news_.wait(lock, [&] { return stopping_ || !watchers_.empty(); });
    } else {
      news_.wait_for(lock, kSpacing);
    }
  }
}

}  // namespace lightmill
