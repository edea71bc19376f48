#include "coordinator/service/streams/watch_feed.h"

#include <chrono>
#include <utility>

#include "common/rpc/convert.h"
#include "coordinator/service/service_status.h"
#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/sequence.pb.h"

namespace lightmill {
namespace {

constexpr std::chrono::milliseconds kSpacing(200);  // between two states of a job
constexpr double kBeatSeconds = 1;                  // a state is sent as often, changed or not

double now_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

const v1::JobStatus& what(const v1::WatchJobResponse& message) { return message.job(); }
const v1::SequenceStatus& what(const v1::WatchSequenceResponse& message) { return message.sequence(); }

template <class Response>
bool is_last(const Response& message) {
  return is_final(from_proto(what(message).state()));
}

}  // namespace

/// Deletes itself once the stream has ended. Its methods want the feed's mutex held, but those of gRPC.
template <class Response>
class WatchFeed<Response>::Watcher final : public grpc::ServerWriteReactor<Response> {
 public:
  Watcher(WatchFeed& feed, grpc::CallbackServerContext& context, std::string id)
      : feed_(feed), id_(std::move(id)), call_(feed.stalls_, context, &feed.group_) {}

  const std::string& id() const { return id_; }
  bool admitted() const { return call_.admitted(); }
  bool wants(const Response& message) const {
    if (writing_ || ended_) return false;
    return !last_ || what(*last_).version() < what(message).version() ||
           now_seconds() - sent_at_ >= kBeatSeconds;
  }
  void send(Message message) {
    writing_ = true;
    last_ = std::move(message);
    sent_at_ = now_seconds();
    call_.begin();
    this->StartWrite(last_.get());
  }
  /// Once what is being written has arrived.
  void end(const grpc::Status& status) {
    if (ended_) return;
    ended_ = true;
    status_ = status;
    if (!writing_) this->Finish(status_);
  }

  void OnWriteDone(bool ok) override {
    const std::lock_guard lock(feed_.mutex_);
    writing_ = false;
    call_.end(ok ? last_->ByteSizeLong() : 0);
    if (ended_) {
      this->Finish(status_);
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
  const std::string id_;
  StallWatch::Call call_;
  Message last_;  // sent or being sent
  double sent_at_ = 0;
  bool writing_ = false, ended_ = false;
  grpc::Status status_;
};

template <class Response>
WatchFeed<Response>::WatchFeed(State state, StallWatch& stalls, size_t most)
    : state_(std::move(state)), stalls_(stalls), group_(stalls, most), thread_([this] { loop(); }) {}

template <class Response>
WatchFeed<Response>::~WatchFeed() {
  stop();
  thread_.join();
}

template <class Response>
void WatchFeed<Response>::stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  news_.notify_all();
}

template <class Response>
grpc::ServerWriteReactor<Response>* WatchFeed<Response>::watch(grpc::CallbackServerContext& context,
                                                               const std::string& id) {
  // Known ones only: nobody waits for what may never come.
  const grpc::Status known = guarded([&] { return state_(id), grpc::Status::OK; });
  auto* const watcher = new Watcher(*this, context, id);
  const std::lock_guard lock(mutex_);
  if (!known.ok()) {
    watcher->end(known);
  } else if (stopping_) {
    watcher->end({grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"});
  } else if (!watcher->admitted()) {
    watcher->end({grpc::StatusCode::RESOURCE_EXHAUSTED, "too many clients watch at once; try again"});
  } else {
    watchers_.insert(watcher);
    news_.notify_all();
  }
  return watcher;
}

template <class Response>
typename WatchFeed<Response>::Message WatchFeed<Response>::state(const std::string& id) {
  const auto added = states_.try_emplace(id);
  Message& made = added.first->second;
  if (added.second) {
    const grpc::Status known = guarded([&] {
      made = std::make_shared<const Response>(state_(id));
      return grpc::Status::OK;
    });
    if (!known.ok()) made = nullptr;
  }
  return made;
}

template <class Response>
void WatchFeed<Response>::look() {
  for (Watcher* watcher : std::set(watchers_)) {
    if (stopping_) {
      watcher->end({grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"});
      continue;
    }
    const Message message = state(watcher->id());
    if (message && watcher->wants(*message)) watcher->send(message);
  }
  states_.clear();
}

template <class Response>
void WatchFeed<Response>::loop() {
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

template class WatchFeed<v1::WatchJobResponse>;
template class WatchFeed<v1::WatchSequenceResponse>;

}  // namespace lightmill
