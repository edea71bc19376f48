#include "coordinator/service/streams/blob_source.h"

#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace lightmill {
namespace {

/// Makes the messages, one after the other.
class BlobSource {
 public:
  BlobSource(BlobStore& blobs, std::vector<std::string> digests)
      : blobs_(blobs), digests_(std::move(digests)) {}

  bool next(v1::FetchBlobsResponse* message) {
    if (reader_) {
      const std::string_view chunk = reader_->next(kSentChunkBytes);
      if (!chunk.empty()) {
        message->set_chunk(chunk.data(), chunk.size());
        return true;
      }
      end();
    }
    if (next_ == digests_.size()) return false;
    begin(message);
    return true;
  }

 private:
  void begin(v1::FetchBlobsResponse* message) {
    const std::string& digest = digests_[next_++];
    reader_ = blobs_.open(digest);
    if (!reader_) throw StatusError({grpc::StatusCode::NOT_FOUND, "the coordinator has no blob " + digest});
    message->mutable_header()->set_digest(digest);
    message->mutable_header()->set_size(reader_->size());
  }
  void end() {
    const bool is_right = reader_->finish();
    reader_.reset();
    // The worker throws away what it got, and finds out when it asks again.
    if (!is_right)
      throw StatusError(
          {grpc::StatusCode::DATA_LOSS, "blob " + digests_[next_ - 1] + " is damaged; ask again"});
  }

  BlobStore& blobs_;
  const std::vector<std::string> digests_;
  size_t next_ = 0;
  std::optional<BlobStore::Reader> reader_;
};

}  // namespace

MessageSource<v1::FetchBlobsResponse> blobs_as_messages(BlobStore& blobs, std::vector<std::string> digests) {
  return [source = std::make_shared<BlobSource>(blobs, std::move(digests))](v1::FetchBlobsResponse* message) {
    return source->next(message);
  };
}

}  // namespace lightmill
