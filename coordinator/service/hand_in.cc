// WorkerService::HandInBlob: a worker brings a scene file that the coordinator has lost.
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/service/service_status.h"
#include "coordinator/service/worker_service.h"

namespace lightmill {
namespace {

constexpr int kMaxHandIns = 8;  // at once, each with a thread
constexpr size_t kMaxHandInChunk = size_t{4} << 20;

}  // namespace

grpc::Status WorkerService::HandInBlob(grpc::ServerContext* context,
                                       grpc::ServerReader<v1::HandInBlobRequest>* reader,
                                       v1::HandInBlobResponse*) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(hand_ins_, kMaxHandIns);
    if (!slot.granted())
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "too many lost files come back at once; try again"};
    StallWatch::Call call(stalls_, *context);
    v1::HandInBlobRequest message;
    if (!call.read(*reader, &message) || !message.has_header())
      throw Error(ErrorKind::kUsage, "a blob that is handed in begins with a header");
    keys_.worker_of(message.header().worker_id());  // throws UnknownWorker
    const std::string digest = message.header().digest();
    const std::unique_ptr<WantedBlobs::Claim> claim = wanted_ ? wanted_->claim(digest) : nullptr;
    if (!claim) return {grpc::StatusCode::ABORTED, "this blob is not wanted, or another worker brings it"};
    if (message.header().size() != claim->size)
      throw Error(ErrorKind::kUsage, "blob " + digest + " has another size than the scene says");
    BlobStore::Writer writer = blobs_.begin(digest, claim->size);
    while (call.read(*reader, &message)) {
      if (message.has_header() || message.chunk().size() > kMaxHandInChunk)
        throw Error(ErrorKind::kUsage, "after the header come chunks of at most 4 MiB");
      writer.write(message.chunk());
    }
    writer.finish();
    wanted_->arrived(digest);
    return grpc::Status::OK;
  });
}

}  // namespace lightmill
