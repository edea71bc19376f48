#pragma once
// Streams of WatchJob. One thread looks at the jobs that are watched and sends to all; a watcher costs no
// thread, and one that takes nothing costs a message. Who is slow gets fewer, newer states.
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "coordinator/core/farm.h"
#include "coordinator/service/limits/stall_watch.h"
#include "lightmill/v1/client.pb.h"

namespace lightmill {

/// Thread-safe.
class WatchFeed {
 public:
  /// At most `most` watchers; both references must outlive the feed.
  WatchFeed(const Farm& farm, StallWatch& stalls, size_t most);
  /// All streams must have ended.
  ~WatchFeed();
  WatchFeed(const WatchFeed&) = delete;
  WatchFeed& operator=(const WatchFeed&) = delete;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* watch(grpc::CallbackServerContext& context,
                                                        const JobId& job);
  /// Ends all streams soon with UNAVAILABLE.
  void stop();

 private:
  class Watcher;
  using Message = std::shared_ptr<const v1::WatchJobResponse>;
  void loop();
  /// The state of a job, made once for all who watch it; null: there is no such job any more.
  Message state(const JobId& job);
  void look();

  const Farm& farm_;
  StallWatch& stalls_;
  StallWatch::Group group_;
  std::recursive_mutex mutex_;  // a write may end within its beginning
  std::condition_variable_any news_;
  // Guarded by mutex_.
  std::set<Watcher*> watchers_;
  std::map<JobId, Message> states_;  // of this look
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace lightmill
