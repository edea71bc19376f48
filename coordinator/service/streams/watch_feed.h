#pragma once
// Streams of WatchJob and WatchSequence. One thread looks at what is watched and sends to all; a watcher
// costs no thread, and one that takes nothing costs a message. Who is slow gets fewer, newer states.
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "coordinator/service/limits/stall_watch.h"

namespace lightmill {

/// Thread-safe. `Response` is v1::WatchJobResponse or v1::WatchSequenceResponse.
template <class Response>
class WatchFeed {
 public:
  /// The state of a job or sequence by its id. Throws as Farm::job.
  using State = std::function<Response(const std::string& id)>;
  /// At most `most` watchers; `stalls` must outlive the feed.
  WatchFeed(State state, StallWatch& stalls, size_t most);
  /// All streams must have ended.
  ~WatchFeed();
  WatchFeed(const WatchFeed&) = delete;
  WatchFeed& operator=(const WatchFeed&) = delete;
  grpc::ServerWriteReactor<Response>* watch(grpc::CallbackServerContext& context, const std::string& id);
  /// Ends all streams soon with UNAVAILABLE.
  void stop();

 private:
  class Watcher;
  using Message = std::shared_ptr<const Response>;
  void loop();
  /// The state, made once for all who watch it; null: it is not there any more.
  Message state(const std::string& id);
  void look();

  const State state_;
  StallWatch& stalls_;
  StallWatch::Group group_;
  std::recursive_mutex mutex_;  // a write may end within its beginning
  std::condition_variable_any news_;
  // Guarded by mutex_.
  std::set<Watcher*> watchers_;
  std::map<std::string, Message> states_;  // of this look
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace lightmill
