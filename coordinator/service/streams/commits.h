#pragma once
// Calls of Commit: a partial comes in, is merged, and is answered once it is durable. They come thousands of
// times a second, so none has a thread while its peer sends, or while it waits for the disk.
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <cstdint>
#include <string>

#include "coordinator/core/farm.h"
#include "coordinator/http/metrics.h"
#include "coordinator/merge/flush_queue.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/task_pool.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/service/worker_keys.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {

/// Thread-safe.
class Commits {
 public:
  /// References must outlive this. Partials that are coming in have at most `most_bytes` together.
  Commits(Farm& farm, Metrics& metrics, TileLog& tile_log, StallWatch& stalls, const WorkerKeys& keys,
          uint64_t most_bytes);
  grpc::ServerReadReactor<v1::CommitRequest>* receive(grpc::CallbackServerContext& context,
                                                      v1::CommitResponse* response);

 private:
  class Call;
  /// Once all of the partial has arrived.
  CommitResult merge(const WorkerId& worker, const v1::CommitRequest::Header& header,
                     const std::string& bytes, std::string* reason);
  /// Once the commit is durable, if it must be; `seconds` after the partial had arrived.
  void answer(const v1::CommitRequest::Header& header, CommitResult result, const std::string& reason,
              double seconds, v1::CommitResponse* response);

  Farm& farm_;
  Metrics& metrics_;
  TileLog& tile_log_;
  StallWatch& stalls_;
  const WorkerKeys& keys_;
  const uint64_t most_bytes_;
  std::atomic<uint64_t> bytes_{0};  // announced by those that are coming in
  StallWatch::Group calls_;
  FlushQueue flush_queue_;
  TaskPool pool_;  // ended first: its tasks use what is above
};

}  // namespace lightmill
