#pragma once
// A call that answers with a stream, without a thread of its own: a peer that takes its time costs the memory
// of one message. What makes messages may block, so that runs in a pool.
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <string>
#include <utility>

#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/service_status.h"
#include "coordinator/service/task_pool.h"

namespace lightmill {

/// Bytes of a chunk: what a peer costs that takes nothing.
inline constexpr size_t kSentChunkBytes = 64 << 10;

/// Fills in the next message; false: that was all. Runs in the pool, and may throw Error.
template <class Response>
using MessageSource = std::function<bool(Response*)>;

/// Where sources are made, and where they make messages.
struct SendingPools {
  TaskPool& opening;
  TaskPool& streaming;
};

/// Deletes itself once the call has ended.
template <class Response>
class SendingCall final : public grpc::ServerWriteReactor<Response> {
 public:
  /// `open` makes the source, in the pool; it may throw Error. References must outlive the call. `what`: what
  /// there are too many of if the group is full.
  SendingCall(grpc::CallbackServerContext& context, StallWatch& stalls, StallWatch::Group& group,
              SendingPools pools, const char* what, std::function<MessageSource<Response>()> open)
      : pools_(pools), open_(std::move(open)), call_(stalls, context, &group) {
    if (call_.admitted()) {
      pools_.opening.run([this] { produce(); });
    } else {
      this->Finish({grpc::StatusCode::RESOURCE_EXHAUSTED, std::string("too many ") + what + "; try again"});
    }
  }
  void OnWriteDone(bool ok) override {
    call_.end(ok ? message_.ByteSizeLong() : 0);
    if (ok) {
      pools_.streaming.run([this] { produce(); });
    } else {
      this->Finish(grpc::Status::CANCELLED);
    }
  }
  void OnDone() override { delete this; }

 private:
  void produce() {
    bool more = false;
    const grpc::Status status = guarded([&] {
      if (!source_) source_ = open_();
      more = source_(&message_);
      return grpc::Status::OK;
    });
    if (!status.ok() || !more) {
      this->Finish(status);
    } else {
      call_.begin();
      this->StartWrite(&message_);
    }
  }

  const SendingPools pools_;
  const std::function<MessageSource<Response>()> open_;
  MessageSource<Response> source_;
  Response message_;
  StallWatch::Call call_;
};

}  // namespace lightmill
