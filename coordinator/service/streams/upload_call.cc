#include "coordinator/service/streams/upload_call.h"

#include <string>

#include "coordinator/farm/farm_errors.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

constexpr size_t kMaxUploadChunk = size_t{4} << 20;

}  // namespace

UploadCall::UploadCall(grpc::CallbackServerContext& context, StallWatch& stalls, StallWatch::Group& group,
                       TaskPool& pool, BlobStore& blobs, const Quotas& quotas,
                       v1::UploadBlobsResponse* response)
    : pool_(pool), blobs_(blobs), quotas_(quotas), response_(response), call_(stalls, context, &group) {
  if (call_.admitted()) {
    read();
  } else {
    Finish({grpc::StatusCode::RESOURCE_EXHAUSTED, "too many scenes are being uploaded at once; try again"});
  }
}

void UploadCall::read() {
  call_.begin();
  StartRead(&message_);
}

void UploadCall::OnReadDone(bool ok) {
  call_.end(ok ? message_.ByteSizeLong() : 0);
  pool_.run([this, ok] {
    const grpc::Status status = guarded([&] {
      if (ok) {
        take();
      } else {
        finish_blob();
        response_->set_blobs(blobs_begun_);
        response_->set_bytes(bytes_);
      }
      return grpc::Status::OK;
    });
    if (ok && status.ok()) {
      read();
    } else {
      Finish(status);
    }
  });
}

void UploadCall::take() {
  if (message_.has_header()) {
    finish_blob();
    if (message_.header().size() > quotas_.max_bundle_bytes - bytes_) {
      throw LimitReached("an upload of more than " + std::to_string(quotas_.max_bundle_bytes) +
                         " bytes (the coordinator's --max-bundle-mb)");
    }
    writer_.emplace(blobs_.begin(message_.header().digest(), message_.header().size()));
    ++blobs_begun_;
    bytes_ += message_.header().size();
  } else if (writer_ && message_.chunk().size() <= kMaxUploadChunk) {
    writer_->write(message_.chunk());
  } else {
    throw Error(ErrorKind::kUsage,
                writer_ ? "an upload chunk is over 4 MiB" : "an upload begins with a header");
  }
}

void UploadCall::finish_blob() {
  if (writer_) writer_->finish();
  writer_.reset();
}

}  // namespace lightmill
