#include "coordinator/service/streams/commits.h"

#include <chrono>
#include <exception>
#include <utility>
#include <variant>

#include "common/base/digest.h"
#include "common/base/log.h"
#include "common/rpc/convert.h"
#include "coordinator/farm/farm_errors.h"
#include "coordinator/service/limits/reservation.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

/// As many partials are decoded and merged at once.
constexpr size_t kMaxMerging = 32;
/// Partials that come in at once, as far as their memory allows.
constexpr size_t kMaxCalls = 8192;

const char* outcome_text(CommitResult result) {
  switch (result) {
    case CommitResult::kAccepted:
    case CommitResult::kAlreadyCommitted:
      return "";
    case CommitResult::kStale:
      return "the lease was lost before the commit";
    case CommitResult::kCorrupt:
      return "the partial does not fit its tile or is damaged; see the coordinator's log";
    case CommitResult::kUnknownJob:
      return "no such job or tile, or the job was cancelled";
  }
  return "";
}

}  // namespace

/// Receives header and chunks, then has them committed. Deletes itself.
class Commits::Call final : public grpc::ServerReadReactor<v1::CommitRequest> {
 public:
  Call(Commits& commits, grpc::CallbackServerContext& context, v1::CommitResponse* response)
      : commits_(commits),
        response_(response),
        reservation_(commits.bytes_, commits.most_bytes_),
        stall_(commits.stalls_, context, &commits.calls_) {
    read();
  }

  void OnReadDone(bool ok) override {
    stall_.end(ok ? message_.ByteSizeLong() : 0);
    Next next = kRead;
    const grpc::Status status = guarded([&] {
      if (!begun_) {
        next = begin(ok);
      } else if (ok) {
        add_chunk();
      } else {
        next = kMerge;
      }
      return grpc::Status::OK;
    });
    if (!status.ok()) {
      Finish(status);
    } else if (next == kMerge) {
      commits_.pool_.run([this] { merge(); });
    } else if (next == kAnswer) {
      conclude();
    } else {
      read();
    }
  }
  void OnDone() override { delete this; }

 private:
  enum Next { kRead, kMerge, kAnswer };

  void read() {
    stall_.begin();
    StartRead(&message_);
  }
  /// The header. Whose lease is not good is told so before it sends more, and before memory is spent.
  Next begin(bool ok) {
    if (!ok || !message_.has_header()) throw Error(ErrorKind::kUsage, "a commit begins with a header");
    if (!stall_.admitted()) throw LimitReached("too many partials come in at once; try again");
    begun_ = true;
    arrived_ = std::chrono::steady_clock::now();
    header_ = message_.header();
    worker_ = commits_.keys_.worker_of(header_.worker_id());
    const auto found = commits_.farm_.announce_commit(worker_, from_proto(header_.key()));
    if (const auto* result = std::get_if<CommitResult>(&found)) {
      result_ = *result;
      return kAnswer;
    }
    if (header_.size() > std::get<uint64_t>(found))
      throw LimitReached("the partial is larger than any of its tile can be");
    if (!reservation_.take(header_.size())) {
      commits_.calls_.cut_slowest(StallWatch::kSlowBytesPerSecond);  // whoever tries again finds room
      throw LimitReached("partials that are coming in fill the coordinator's --commit-memory; try again");
    }
    return kRead;
  }
  void add_chunk() {
    if (message_.has_header()) throw Error(ErrorKind::kUsage, "a second header in a commit");
    if (bytes_.size() + message_.chunk().size() > header_.size())
      throw Error(ErrorKind::kUsage, "the partial is longer than announced");
    if (bytes_.empty()) {
      bytes_ = std::move(*message_.mutable_chunk());
    } else {
      bytes_ += message_.chunk();
    }
  }

  void merge() {
    arrived_ = std::chrono::steady_clock::now();
    const grpc::Status status = guarded([this] {
      result_ = commits_.merge(worker_, header_, bytes_, &reason_);
      return grpc::Status::OK;
    });
    if (!status.ok()) return Finish(status);
    conclude();
  }
  void conclude() {
    if (!must_be_durable(result_)) return answer(grpc::Status::OK);
    commits_.flush_queue_.when_durable([this](const std::exception_ptr& failure) {
      answer(guarded([&] {
        if (failure) std::rethrow_exception(failure);
        return grpc::Status::OK;
      }));
    });
  }
  void answer(const grpc::Status& status) {
    if (!status.ok()) return Finish(status);
    Finish(guarded([this] {
      const auto passed = std::chrono::steady_clock::now() - arrived_;
      commits_.answer(header_, result_, reason_, std::chrono::duration<double>(passed).count(), response_);
      return grpc::Status::OK;
    }));
  }

  Commits& commits_;
  v1::CommitResponse* const response_;
  Reservation reservation_;
  StallWatch::Call stall_;
  v1::CommitRequest message_;
  v1::CommitRequest::Header header_;
  WorkerId worker_;
  std::string bytes_;  // grows as chunks arrive: an announced size alone allocates nothing
  bool begun_ = false;
  std::chrono::steady_clock::time_point arrived_;  // all of it
  CommitResult result_ = CommitResult::kStale;
  std::string reason_;
};

Commits::Commits(Farm& farm, Metrics& metrics, TileLog& tile_log, StallWatch& stalls, const WorkerKeys& keys,
                 uint64_t most_bytes)
    : farm_(farm),
      metrics_(metrics),
      tile_log_(tile_log),
      stalls_(stalls),
      keys_(keys),
      most_bytes_(most_bytes),
      calls_(stalls, kMaxCalls),
      flush_queue_([this] { farm_.flush(); }),
      pool_(kMaxMerging) {}

grpc::ServerReadReactor<v1::CommitRequest>* Commits::receive(grpc::CallbackServerContext& context,
                                                             v1::CommitResponse* response) {
  return new Call(*this, context, response);
}

CommitResult Commits::merge(const WorkerId& worker, const v1::CommitRequest::Header& header,
                            const std::string& bytes, std::string* reason) {
  if (bytes.size() != header.size()) throw Error(ErrorKind::kUsage, "the partial is shorter than announced");
  if (sha256_hex(bytes) != header.digest())
    throw Error(ErrorKind::kUsage, "the partial was damaged on its way: its digest differs");
  const LeaseKey key = from_proto(header.key());
  const LogScope scope(log_context(worker, key));
  return farm_.commit_unflushed(worker, key, bytes, reason);
}

void Commits::answer(const v1::CommitRequest::Header& header, CommitResult result, const std::string& reason,
                     double seconds, v1::CommitResponse* response) {
  const LogScope scope(log_context(WorkerKeys::shown(header.worker_id()), from_proto(header.key())));
  response->set_outcome(to_proto(result));
  response->set_message(reason.empty() ? outcome_text(result) : one_line(reason));
  if (result == CommitResult::kAccepted) {
    metrics_.committed(seconds);
    tile_log_.add("committed: " + std::to_string(header.size()) + " bytes");
  } else if (result != CommitResult::kCorrupt) {  // of that the farm's own log speaks
    tile_log_.add(result == CommitResult::kAlreadyCommitted ? "committed once more"
                                                            : "not committed: " + response->message());
  }
}

}  // namespace lightmill
